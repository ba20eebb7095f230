//! Flags of `mrt light`.

use crate::cli::import_args::ImportArgs;
use glam::{DVec3, Vec3};
use std::path::PathBuf;
use std::str::FromStr;

/// Largest side of a picture, pixels.
const MOST_PIXELS_A_SIDE: usize = 16_384;

/// Lights a real mesh through its blocks: pictures, the lightmap, and the mesh with its coordinates.
#[derive(Clone, Debug, clap::Args)]
pub struct LightArgs {
    /// Mesh to light: .obj, .glb or .gltf.
    #[arg(long)]
    pub scene: PathBuf,
    /// Level around the mesh, as `map` writes it.
    #[arg(long)]
    pub level: PathBuf,
    /// Folder for the pictures; made if missing.
    #[arg(long)]
    pub out: PathBuf,
    /// Light: x,y,z,intensity or x,y,z,intensity,r,g,b (metres, W/sr); may be repeated [default: the mesh's
    /// lamps; without any, and if nothing in the level shines, a few in the largest blocks].
    #[arg(long, allow_hyphen_values = true)]
    pub light: Vec<LightArg>,
    /// Radius of the lights, metres [default: a tenth of the block's width].
    #[arg(long)]
    pub light_radius: Option<f32>,
    /// Dictionary file [default: the built-in one].
    #[arg(long)]
    pub dictionary: Option<PathBuf>,
    /// Preset to bake on the spot instead: mobile, standard, high or quality.
    #[arg(long, conflicts_with = "dictionary")]
    pub preset: Option<String>,
    /// Number of bounces, or `all`.
    #[arg(long, default_value = "all", value_parser = parse_bounces)]
    pub bounces: BounceLimit,
    /// What shadows the blocks' direct light.
    #[arg(long, value_enum, default_value = "openings")]
    pub shadows: Shadows,
    /// Camera: x,y,z;x,y,z (from;to, metres); may be repeated [default: at the lights, and one from
    /// outside].
    #[arg(long, allow_hyphen_values = true)]
    pub camera: Vec<ViewArg>,
    /// Size of the pictures.
    #[arg(long, default_value = "960x540", value_parser = parse_size)]
    pub size: PictureSize,
    /// `auto`, or stops: each doubles the brightness.
    #[arg(long, default_value = "auto", allow_hyphen_values = true)]
    pub exposure: Exposure,
    /// How the mesh is read.
    #[command(flatten)]
    pub import: ImportArgs,
    /// Print the report as one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// Number of bounces; `None` is all.
pub type BounceLimit = Option<u32>;

/// Width and height, pixels.
pub type PictureSize = [usize; 2];

/// A light on the command line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightArg {
    /// Metres, in the mesh's coordinates.
    pub position: DVec3,
    /// W/sr.
    pub intensity: f32,
    /// Factor per channel.
    pub colour: Vec3,
}

/// A camera on the command line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewArg {
    /// Where it stands, metres, in the mesh's coordinates.
    pub from: DVec3,
    /// What it looks at, metres.
    pub to: DVec3,
}

/// How bright the pictures are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Chosen from what the picture shows.
    Auto,
    /// Stops: each doubles the brightness.
    Value(f32),
}

/// What shadows the blocks' direct light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Shadows {
    /// The walls of the blocks.
    Openings,
    /// The mesh, by rays.
    Rays,
}

impl FromStr for LightArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected =
            || format!("found `{text}`; expected x,y,z,intensity or x,y,z,intensity,r,g,b");
        let (position, intensity, colour) = match *numbers(text).ok_or_else(expected)? {
            [x, y, z, intensity] => (DVec3::new(x, y, z), intensity, DVec3::ONE),
            [x, y, z, intensity, r, g, b] => (DVec3::new(x, y, z), intensity, DVec3::new(r, g, b)),
            _ => return Err(expected()),
        };
        Ok(Self {
            position,
            intensity: intensity as f32,
            colour: colour.as_vec3(),
        })
    }
}

impl FromStr for ViewArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("found `{text}`; expected x,y,z;x,y,z");
        let (from, to) = text.split_once(';').ok_or_else(expected)?;
        let point = |text: &str| match *numbers(text)? {
            [x, y, z] => Some(DVec3::new(x, y, z)),
            _ => None,
        };
        Ok(Self {
            from: point(from).ok_or_else(expected)?,
            to: point(to).ok_or_else(expected)?,
        })
    }
}

impl FromStr for Exposure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let stops = text.parse().ok().filter(|ev: &f32| ev.abs() <= 60.0);
        stops
            .map(Self::Value)
            .ok_or_else(|| format!("found `{text}`; expected `auto` or stops from -60 to 60"))
    }
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',')
        .map(|word| word.trim().parse().ok())
        .collect()
}

fn parse_bounces(text: &str) -> Result<BounceLimit, String> {
    if text == "all" {
        return Ok(None);
    }
    let count = text.parse().ok().filter(|&count: &u32| count <= 1000);
    count
        .map(Some)
        .ok_or_else(|| format!("found `{text}`; expected `all` or a number from 0 to 1000"))
}

fn parse_size(text: &str) -> Result<PictureSize, String> {
    let side = |text: &str| {
        let side = text.parse().ok();
        side.filter(|side| (1..=MOST_PIXELS_A_SIDE).contains(side))
    };
    text.split_once('x')
        .and_then(|(width, height)| Some([side(width)?, side(height)?]))
        .ok_or_else(|| format!("found `{text}`; expected WIDTHxHEIGHT, each from 1 to 16384"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_say_what_they_expect() {
        let light: LightArg = "1, 2,-3,40".parse().expect("parses");
        assert_eq!(light.position, DVec3::new(1.0, 2.0, -3.0));
        assert_eq!(light.colour, Vec3::ONE);
        for bad in ["", "1,2,3", "1,2,3,4,5", "a,b,c,d"] {
            let error = bad.parse::<LightArg>().expect_err("refused");
            assert!(error.contains("expected x,y,z,intensity"), "{error}");
        }
        assert!("0,0,0".parse::<ViewArg>().is_err());
        assert!("0,0,0;1,1,1".parse::<ViewArg>().is_ok());
        assert_eq!("-1.5".parse(), Ok(Exposure::Value(-1.5)));
        assert!("nan".parse::<Exposure>().is_err());
        assert_eq!(parse_size("64x32"), Ok([64, 32]));
        assert!(parse_size("64x0").is_err());
        assert!(parse_size("99999x9").is_err());
        assert_eq!(parse_bounces("all"), Ok(None));
        assert!(parse_bounces("-1").is_err());
    }
}
