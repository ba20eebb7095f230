//! Dynamic indirect light for games: Modular Radiance Transfer at run time (Loos et al., "Modular Radiance Transfer",
//! SIGGRAPH Asia 2011).
//!
//! A [`Dictionary`] holds the light transport of a few canonical shapes, computed once. A [`Level`] places warped
//! copies of these shapes and joins their openings. A [`Scene`] is assembled from both; it never changes and is cheap
//! to share between threads. A [`Frame`] keeps a scene, takes [`Light`]s, and computes a [`Lightmap`] and the light at
//! any point.
//!
//! ```
//! use mrt_runtime::glam::{Vec3, vec3};
//! use mrt_runtime::{AssembleConfig, Dictionary, Frame, FrameConfig, Level, Light, Scene};
//!
//! // Once: a dictionary, a level, a scene of both, and a frame of the scene.
//! let dictionary = Dictionary::from_bytes(include_bytes!("../../assets/cubes-2d-standard.mrt"))?;
//! let level = Level::from_text(include_str!("../../assets/maze.level.toml"))?;
//! let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
//! let mut frame = Frame::new(&scene, FrameConfig::default());
//! let torch = frame.add_light(Light::sphere(vec3(0.5, 0.7, 0.5), 0.1, Vec3::splat(2.0)));
//!
//! // Every frame: move lights, and upload the tiles of the lightmap that changed. By default, each frame adds one bounce to the
//! // light of the previous frame.
//! let mut staging = Vec::new();
//! frame.set_light(torch, Light::sphere(vec3(0.5, 0.6, 0.5), 0.1, Vec3::splat(2.0)));
//! let report = frame.solve();
//! for tile in report.changed_tiles() {
//!     frame.lightmap().write_rgba16f(tile, &mut staging);
//! }
//! assert!(report.skipped_lights().is_empty() && !staging.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Positions are in metres, axes right-handed with +Y up, colours linear RGB, irradiance in W/m², intensities in W/sr.
//!
//! Features: `text` (default) reads and writes levels as TOML; `timing` measures the stages of a frame; `rayon` adds an
//! [`Executor`](executor::Executor) that uses rayon's threads; `generator` makes mazes. Without features, the frame
//! alone remains.

mod level;
mod light;
mod output;
mod modular;
pub mod executor;
pub mod blocks;
pub mod shadows;
pub mod low_level;

pub use glam;
pub use level::block::Level;
pub use level::block_index::BlockIndex;
pub use level::error::LevelError;
#[cfg(feature = "text")]
pub use level::text::LevelTextError;
pub use light::source::{Light, LightError};
pub use modular::assemble::config::{AssembleConfig, Coupling};
pub use modular::assemble::error::AssembleError;
pub use modular::dictionary::types::Dictionary;
pub use modular::dictionary_file::format::DictionaryError;
pub use modular::frame::Frame;
pub use modular::frame::config::{Bounces, FrameConfig, Outputs};
pub use modular::frame::error::FrameError;
pub use modular::frame::light_list::{LightId, SkippedLight};
pub use modular::frame::report::FrameReport;
#[cfg(feature = "timing")]
pub use modular::frame::stage_clock::StageTimes;
pub use modular::frame::surface::SurfaceError;
pub use modular::scene::Scene;
pub use mrt_core::simd::SimdLevel;
pub use mrt_core::storage::Storage;
pub use output::lightmap::Lightmap;
pub use output::lightmap_atlas::Tile;
pub use output::probe_order::ProbeOrder;
pub use output::probes::Probes;

/// Tests the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
