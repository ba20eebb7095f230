//! Flags of commands that read a mesh, and what they say about it.

use crate::cli::output::{print_row, warn};
use crate::import::config::ImportConfig;
use crate::import::error::ImportError;
use crate::import::report::ImportReport;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use glam::DVec3;
use mrt_runtime::blocks::{MeshReading, UpAxis};

/// Warnings printed, at most, and characters of each.
const MOST_WARNINGS: usize = 10;
const MOST_CHARACTERS: usize = 400;

/// Left-out materials and unused kinds that are listed, at most.
const MOST_ROWS: usize = 20;

/// How a mesh is read. `map` keeps it in the level, and `light` takes it from there.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct ImportArgs {
    /// Metres per unit of the mesh file [default: the level's, or 1].
    #[arg(long)]
    pub scale: Option<f64>,
    /// The mesh file's vertical axis [default: the level's, or y].
    #[arg(long, value_parser = up_parser())]
    pub up: Option<UpAxis>,
    /// Albedo for everything, 0 to 1, instead of the mesh's colours.
    #[arg(long)]
    pub albedo: Option<f32>,
    /// Leave out triangles of this material; `*` stands for any text; may be repeated [default: the level's, or none].
    #[arg(long, value_name = "NAME")]
    pub skip_material: Vec<String>,
    /// Read only triangles of this material; `*` stands for any text; may be repeated [default: the level's, or all].
    #[arg(long, value_name = "NAME")]
    pub only_material: Vec<String>,
    /// Read faces whose materials are named like those that level editors give to skies, triggers, clips and other helpers.
    #[arg(long)]
    pub keep_tool_materials: bool,
}

/// A flag contradicts how the mesh was read when its level was made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReadingMismatch {
    /// Another scale.
    #[error("--scale {found}: the level was mapped at {expected} m a unit, of which this is {} times; leave --scale out, or map the mesh again", rounded(found / expected))]
    Scale {
        /// Of the level.
        expected: f64,
        /// Given.
        found: f64,
    },
    /// Another axis.
    #[error(
        "--up {found}: the level was mapped with --up {expected}; leave --up out, or map the mesh again"
    )]
    Up {
        /// Of the level.
        expected: &'static str,
        /// Given.
        found: &'static str,
    },
    /// Other materials.
    #[error(
        "{found}: the level was mapped with {expected}; leave the flag out, or map the mesh again"
    )]
    Materials {
        /// Flags of the level.
        expected: String,
        /// Flags given.
        found: String,
    },
}

fn up_parser() -> impl TypedValueParser<Value = UpAxis> {
    let names = UpAxis::ALL.map(UpAxis::name);
    // Other names do not get this far.
    PossibleValuesParser::new(names).map(|name| UpAxis::from_name(&name).unwrap_or_default())
}

impl ImportArgs {
    /// How to read a mesh of which nothing is known.
    pub fn config(&self) -> ImportConfig {
        ImportConfig {
            scale: self.scale.unwrap_or(1.0),
            up: self.up.unwrap_or_default(),
            albedo: self.albedo,
            skip_materials: self.skip_material.clone(),
            only_materials: self.only_material.clone(),
            keeps_tool_materials: self.keep_tool_materials,
            origin: None,
        }
    }

    /// How to read the mesh of a level: as when the level was made. Levels without a word about it were made in the mesh's
    /// own metres.
    ///
    /// # Errors
    /// [`ReadingMismatch`], if a flag contradicts the level.
    pub fn config_for(&self, level: Option<&MeshReading>) -> Result<ImportConfig, ReadingMismatch> {
        let Some(level) = level else {
            return Ok(ImportConfig {
                origin: Some(DVec3::ZERO),
                ..self.config()
            });
        };
        let expected = level.scale;
        // Written differently, the same number may differ in its last bits.
        let is_same = |found: &f64| (found - expected).abs() <= 1e-9 * expected;
        if let Some(found) = self.scale.filter(|found| !is_same(found)) {
            return Err(ReadingMismatch::Scale { expected, found });
        }
        if let Some(found) = self.up.filter(|&up| up != level.up) {
            return Err(ReadingMismatch::Up {
                expected: level.up.name(),
                found: found.name(),
            });
        }
        let differs = |given: &[String], kept: &[String]| !given.is_empty() && given != kept;
        if differs(&self.skip_material, &level.skip_materials)
            || differs(&self.only_material, &level.only_materials)
            || self.keep_tool_materials && !level.keeps_tool_materials
        {
            let given = self.config();
            return Err(ReadingMismatch::Materials {
                expected: material_flags(
                    &level.skip_materials,
                    &level.only_materials,
                    level.keeps_tool_materials,
                ),
                found: material_flags(
                    &given.skip_materials,
                    &given.only_materials,
                    given.keeps_tool_materials,
                ),
            });
        }
        Ok(ImportConfig {
            scale: level.scale,
            up: level.up,
            albedo: self.albedo,
            skip_materials: level.skip_materials.clone(),
            only_materials: level.only_materials.clone(),
            keeps_tool_materials: level.keeps_tool_materials,
            origin: Some(level.origin),
        })
    }
}

/// The flags as one would type them.
fn material_flags(skip: &[String], only: &[String], keeps_tools: bool) -> String {
    let skip = skip
        .iter()
        .map(|name| format!("--skip-material {}", one_line(name)));
    let only = only
        .iter()
        .map(|name| format!("--only-material {}", one_line(name)));
    let tools = keeps_tools.then(|| "--keep-tool-materials".to_owned());
    let flags: Vec<String> = skip.chain(only).chain(tools).collect();
    if flags.is_empty() {
        "no flags for materials".to_owned()
    } else {
        flags.join(" ")
    }
}

/// Six digits at most.
fn rounded(value: f64) -> f64 {
    let digits = format!("{value:.5e}");
    digits.parse().unwrap_or(value)
}

/// The flag that may help, as the end of an error's line.
pub fn import_hint(error: &ImportError) -> &'static str {
    match error {
        ImportError::OutOfRange { size, .. } if *size < 1e6 => {
            " (the mesh lies too far from its origin: move it nearer, or see --scale)"
        }
        ImportError::OutOfRange { .. } => " (the mesh is too large: see --scale)",
        ImportError::AllLeftOut { .. } => {
            " (see --keep-tool-materials, --skip-material and --only-material)"
        }
        _ => "",
    }
}

/// Writes what was missing or faulty to standard error.
pub fn warn_of_import(report: &ImportReport) {
    for warning in report.warnings.iter().take(MOST_WARNINGS) {
        warn(format_args!("warning: {}", one_line(warning)));
    }
    let more = report.warnings.len().saturating_sub(MOST_WARNINGS);
    if more > 0 {
        warn(format_args!("warning: and {more} more (see --json)"));
    }
}

/// Text of a file on one line of bounded length, which tells a terminal nothing but what to show.
fn one_line(text: &str) -> String {
    let mut line = String::new();
    for (count, character) in text.chars().enumerate() {
        if count == MOST_CHARACTERS {
            return line + "...";
        }
        match character {
            '\'' | '"' | '\\' => line.push(character),
            _ => line.extend(character.escape_debug()),
        }
    }
    line
}

/// Prints what was read.
pub fn print_import(report: &ImportReport) {
    let [x, y, z] = report.size_m;
    print_row("triangles", report.triangles);
    print_row(
        "  left out",
        format!(
            "{} without area, {} not finite; {} unused vertices",
            report.degenerate_triangles, report.not_finite_triangles, report.unused_vertices
        ),
    );
    let materials = report.left_out_materials.iter();
    print_rows(materials.map(|(name, count)| {
        let text = format!("{count} of material `{}`", one_line(name));
        ("  left out", text)
    }));
    print_row(
        "edges",
        format!(
            "{} non-manifold, {} boundary",
            report.non_manifold_edges, report.boundary_edges
        ),
    );
    print_row(
        "size",
        format!("{x:.3} x {y:.3} x {z:.3} m at {} m a unit", report.scale),
    );
    if report.origin_m != [0.0; 3] {
        let [x, y, z] = report.origin_m;
        print_row(
            "origin",
            format!("the level's is at ({x}, {y}, {z}) m of the mesh, which is far from its own"),
        );
    }
    print_row(
        "materials",
        format!(
            "{}; {} without a colour, taken as grey; {} emissive",
            report.materials, report.made_up_albedos, report.emissive_materials
        ),
    );
    print_row("images", report.images);
    print_row("lamps in the mesh", report.lamps);
    let ignored = report.ignored.iter();
    print_rows(ignored.map(|(kind, count)| ("not used", format!("{count} {}", one_line(kind)))));
}

/// Prints the first rows and how many more there are.
fn print_rows(mut rows: impl ExactSizeIterator<Item = (&'static str, String)>) {
    for (name, text) in rows.by_ref().take(MOST_ROWS) {
        print_row(name, text);
    }
    if rows.len() > 0 {
        print_row("", format!("and {} more (see --json)", rows.len()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level() -> MeshReading {
        MeshReading {
            scale: 0.01,
            origin: DVec3::splat(1e6),
            skip_materials: vec!["sky".to_owned()],
            ..MeshReading::default()
        }
    }

    #[test]
    fn flags_that_are_missing_take_what_the_level_says() {
        let config = ImportArgs::default()
            .config_for(Some(&level()))
            .expect("agrees");
        assert_eq!(
            (config.scale, config.origin),
            (0.01, Some(DVec3::splat(1e6)))
        );
        assert_eq!(config.skip_materials, ["sky"]);
        let same = ImportArgs {
            scale: Some(0.01),
            up: Some(UpAxis::Y),
            skip_material: vec!["sky".to_owned()],
            ..ImportArgs::default()
        };
        assert_eq!(same.config_for(Some(&level())), Ok(config));
        let alone = same.config_for(None).expect("nothing to contradict");
        assert_eq!(alone.origin, Some(DVec3::ZERO));
    }

    #[test]
    fn flags_that_contradict_the_level_are_refused_with_both_values() {
        let error = |args: ImportArgs| {
            args.config_for(Some(&level()))
                .expect_err("refused")
                .to_string()
        };
        let scale = error(ImportArgs {
            scale: Some(1.0),
            ..ImportArgs::default()
        });
        assert!(
            scale.contains("0.01 m a unit") && scale.contains("100 times"),
            "{scale}"
        );
        let up = error(ImportArgs {
            up: Some(UpAxis::Z),
            ..ImportArgs::default()
        });
        assert!(up.contains("--up z") && up.contains("--up y"), "{up}");
        let materials = error(ImportArgs {
            keep_tool_materials: true,
            ..ImportArgs::default()
        });
        assert!(materials.contains("--skip-material sky"), "{materials}");
    }

    #[test]
    fn text_of_files_cannot_steer_a_terminal() {
        assert_eq!(
            one_line("a\x1b[31m\n`b`\u{202e}\"é"),
            "a\\u{1b}[31m\\n`b`\\u{202e}\"é"
        );
        assert_eq!(one_line(&"x".repeat(9999)).len(), MOST_CHARACTERS + 3);
    }
}
