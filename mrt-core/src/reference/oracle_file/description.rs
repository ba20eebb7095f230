//! The description of a reference file, and the checks of what it says.

use super::context::{FileContext, Shown};
use super::error::ReferenceError;
use super::reference_file::Kind;
use crate::geometry::cube::Face;
use crate::reference::cells::CellIndex;
use glam::DVec3;
use serde::Deserialize;

const MAX_CELLS: u64 = 4096;
const MAX_RESOLUTION: u64 = 512;
/// Coordinates are far from the ends of the number range, so that neighbours and sizes cannot overflow.
const MAX_COORDINATE: u64 = 1 << 20;

#[derive(Deserialize)]
pub(super) struct Description {
    pub(super) name: String,
    pub(super) kind: Option<String>,
    pub(super) cells: Vec<[i32; 3]>,
    pub(super) lights: Vec<[f64; 3]>,
    pub(super) intensity: f64,
    pub(super) resolution: Option<u64>,
    pub(super) bounces: Option<u64>,
    pub(super) walls: Option<Vec<([i32; 3], String)>>,
    pub(super) albedo: Option<Albedo>,
    #[serde(default)]
    pub(super) terms: Vec<String>,
    pub(super) points: Option<Vec<[f64; 3]>>,
    pub(super) shape: Vec<u64>,
}

#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum Albedo {
    Uniform(f64),
    PerWall(Vec<[f64; 3]>),
}

/// Checks cells, lights and the list of walls; returns the cells' index and the walls that they imply.
pub(super) fn check_level(
    file: &FileContext,
    parsed: &Description,
) -> Result<(CellIndex, Vec<(usize, Face)>), ReferenceError> {
    let cells = &parsed.cells;
    file.check_limit("the number of cells", cells.len() as u64, MAX_CELLS)?;
    if cells.is_empty() {
        return Err(file.malformed("cells", "at least one", "an empty list"));
    }
    for &x in cells.as_flattened() {
        let size = u64::from(x.unsigned_abs());
        file.check_limit("a cell coordinate", size, MAX_COORDINATE)?;
    }
    let (index, twice) = CellIndex::new(cells);
    if let Some(k) = twice {
        let what = format!("cell {k}");
        return Err(file.malformed(what, "a cell not listed before", Shown(cells[k])));
    }
    if parsed.lights.is_empty() {
        return Err(file.malformed("lights", "at least one", "an empty list"));
    }
    for (k, &light) in parsed.lights.iter().enumerate() {
        if index.of_point(DVec3::from_array(light)).is_none() {
            let what = format!("light {k}");
            return Err(file.malformed(what, "a point inside a cell", Shown(light)));
        }
    }
    if !(parsed.intensity > 0.0 && parsed.intensity.is_finite()) {
        return Err(file.malformed("intensity", "a finite number above 0", parsed.intensity));
    }
    let implied: Vec<(usize, Face)> = (0..cells.len())
        .flat_map(|cell| Face::ALL.map(|face| (cell, face)))
        .filter(|&(cell, face)| index.across(cells[cell], face).is_none())
        .collect();
    if let Some(walls) = &parsed.walls {
        check_walls(file, (cells, &index), walls, &implied)?;
    }
    Ok((index, implied))
}

/// Checks that a file lists the walls that its cells imply, in the same order.
fn check_walls(
    file: &FileContext,
    (cells, index): (&[[i32; 3]], &CellIndex),
    walls: &[([i32; 3], String)],
    implied: &[(usize, Face)],
) -> Result<(), ReferenceError> {
    for (k, (cell, face)) in walls.iter().enumerate() {
        let what = format!("wall {k}");
        if Face::from_name(face).is_none() {
            return Err(file.malformed(what, "a face -x, +x, -y, +y, -z or +z", Shown(face)));
        }
        if index.position(*cell).is_none() {
            return Err(file.malformed(what, "a face of a listed cell", Shown(cell)));
        }
        match implied.get(k) {
            Some(&(c, f)) if cells[c] == *cell && f.name() == face => {}
            Some(&(c, f)) => {
                let expected = format!("{f} of {:?}, cell by cell and face by face", cells[c]);
                return Err(file.malformed(what, expected, format!("{face} of {cell:?}")));
            }
            None => return Err(file.malformed(what, "no such wall", Shown(cell))),
        }
    }
    if walls.len() != implied.len() {
        return Err(file.malformed("the number of walls", implied.len(), walls.len()));
    }
    Ok(())
}

/// The kind of a file, and the shape of its numbers that follows from it.
pub(super) fn check_kind(
    file: &FileContext,
    parsed: &Description,
    (index, walls): (&CellIndex, &[(usize, Face)]),
) -> Result<(Kind, Vec<u64>), ReferenceError> {
    match parsed.kind.as_deref() {
        None | Some("irradiance") => check_irradiance(file, parsed, walls),
        Some("irradiance_rgb") => check_irradiance_rgb(file, parsed, walls),
        Some("radiance_sh9") => check_radiance_sh9(file, parsed, index),
        Some(other) => {
            let expected = "irradiance (or absent), irradiance_rgb or radiance_sh9";
            Err(file.malformed("kind", expected, Shown(other)))
        }
    }
}

fn check_irradiance(
    file: &FileContext,
    parsed: &Description,
    walls: &[(usize, Face)],
) -> Result<(Kind, Vec<u64>), ReferenceError> {
    let [wall_count, v, u] = check_texels(file, parsed, walls)?;
    let Some(terms) = parsed.bounces.and_then(|bounces| bounces.checked_add(1)) else {
        return Err(file.malformed("bounces", "a count", "absent or too large"));
    };
    let lights = parsed.lights.len() as u64;
    Ok((Kind::Irradiance, vec![lights, terms, wall_count, v, u]))
}

fn check_irradiance_rgb(
    file: &FileContext,
    parsed: &Description,
    walls: &[(usize, Face)],
) -> Result<(Kind, Vec<u64>), ReferenceError> {
    let [wall_count, v, u] = check_texels(file, parsed, walls)?;
    let Some(Albedo::PerWall(albedo)) = &parsed.albedo else {
        return Err(file.malformed("albedo", "one colour for each wall", "another form"));
    };
    if albedo.len() != walls.len() {
        return Err(file.malformed("the number of albedos", walls.len(), albedo.len()));
    }
    for (k, rgb) in albedo.iter().enumerate() {
        rgb.iter()
            .try_for_each(|&a| file.check_albedo(format!("albedo of wall {k}"), a))?;
    }
    let kind = Kind::IrradianceRgb {
        albedo: albedo.clone(),
    };
    let lights = parsed.lights.len() as u64;
    let terms = check_two_terms(file, parsed)?;
    Ok((kind, vec![lights, terms, wall_count, v, u, 3]))
}

fn check_radiance_sh9(
    file: &FileContext,
    parsed: &Description,
    index: &CellIndex,
) -> Result<(Kind, Vec<u64>), ReferenceError> {
    let Some(Albedo::Uniform(albedo)) = parsed.albedo else {
        return Err(file.malformed("albedo", "one number", "another form"));
    };
    file.check_albedo("albedo".into(), albedo)?;
    let points: Vec<DVec3> = match &parsed.points {
        Some(points) if !points.is_empty() => {
            points.iter().copied().map(DVec3::from_array).collect()
        }
        _ => return Err(file.malformed("points", "at least one", "an empty list")),
    };
    for (k, &point) in points.iter().enumerate() {
        if index.of_point(point).is_none() {
            let what = format!("point {k}");
            return Err(file.malformed(what, "a point inside a cell", point));
        }
    }
    let lights = parsed.lights.len() as u64;
    let shape = vec![
        lights,
        check_two_terms(file, parsed)?,
        points.len() as u64,
        9,
    ];
    Ok((Kind::RadianceSh9 { albedo, points }, shape))
}

/// Sizes of the dimensions wall, v and u.
fn check_texels(
    file: &FileContext,
    parsed: &Description,
    walls: &[(usize, Face)],
) -> Result<[u64; 3], ReferenceError> {
    if parsed.walls.is_none() {
        return Err(file.malformed("walls", "a list", "absent"));
    }
    let resolution = parsed.resolution.unwrap_or(0);
    file.check_limit("resolution", resolution, MAX_RESOLUTION)?;
    if resolution == 0 {
        return Err(file.malformed("resolution", "at least 1", "0 or absent"));
    }
    Ok([walls.len() as u64, resolution, resolution])
}

fn check_two_terms(file: &FileContext, parsed: &Description) -> Result<u64, ReferenceError> {
    match parsed.terms.len() {
        2 => Ok(2),
        found => Err(file.malformed("the number of terms", 2, found)),
    }
}
