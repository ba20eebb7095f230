//! Modular Radiance Transfer at run time (Loos et al., "Modular Radiance Transfer", SIGGRAPH Asia
//! 2011), in the order in which data flows.
//!
//! A [`shape`](level::shape) is a cube with faces missing, and a [`dictionary`](modular::dictionary) holds the baked
//! operators of shapes. A [`level`] places warped shapes and joins their openings; [`assemble`](modular::assemble) turns
//! both into a [`scene`](modular::scene), which a game keeps. Every frame takes [`light`]s through
//! [direct light](light::direct_light) and the reduced operators to indirect irradiance ([`frame`](modular::frame)) and
//! copies it to a [lightmap](output::lightmap_atlas).
//!
//! ```
//! use glam::{Vec3, vec3};
//! use mrt_core::container::ByteBudget;
//! use mrt_runtime::modular::assemble::{AssembleConfig, assemble};
//! use mrt_runtime::modular::dictionary::Dictionary;
//! use mrt_runtime::modular::frame::{Bounces, Frame};
//! use mrt_runtime::level::text;
//! use mrt_runtime::light::placed::Light;
//! use mrt_runtime::light::visibility::Openings;
//!
//! // Once: a dictionary, a level, the scene that both make, and the buffers of its frames.
//! let bytes = include_bytes!("../../assets/cubes-2d-standard.mrt");
//! let dictionary = Dictionary::from_bytes(bytes, &mut ByteBudget::new(16 << 20))?;
//! let level = text::from_text(include_str!("../../assets/maze.level.toml"))?;
//! let scene = assemble(&level, &dictionary, &AssembleConfig::default())?;
//! let mut frame = Frame::new(&scene);
//!
//! // Every frame: lights in, irradiance out. Feedback adds a bounce a frame.
//! let lamp = Light::Sphere {
//!     position: vec3(0.5, 0.7, 0.5),
//!     radius: 0.1,
//!     intensity: Vec3::splat(2.0),
//! };
//! frame.solve(&scene, &[lamp], &Openings, Bounces::Feedback)?;
//!
//! // The lightmap goes to a texture; a wall of block 0 finds its place in it.
//! let wall = scene.blocks[0].shape.walls().next().expect("every shape has walls");
//! let uv = scene.atlas.texture_coordinate(0, wall, 0.5, 0.5).expect("a wall");
//! assert_eq!(frame.lightmap().len(), scene.atlas.width * scene.atlas.height);
//! assert!(uv.x < 1.0 && frame.indirect_at(&scene, 0, 0)[0] > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod level;
pub mod light;
pub mod output;
pub mod modular;
pub mod executor;
