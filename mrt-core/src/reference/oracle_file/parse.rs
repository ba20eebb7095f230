//! From bytes that may hold anything to a checked [`ReferenceFile`].

use std::fmt::{Debug, Display};
use std::path::Path;

use crate::geometry::cube::Face;
use glam::DVec3;
use serde::Deserialize;

use super::{Kind, ReferenceError, ReferenceFile, cell_of};
use crate::reference::error_measure::neighbour_cell;

/// Bytes of a description; the largest known takes 8 kB.
const MAX_JSON_BYTES: u64 = 4 << 20;
/// Numbers in a file, 256 MB.
const MAX_VALUES: u64 = 64 << 20;
const MAX_CELLS: u64 = 4096;
const MAX_RESOLUTION: u64 = 512;
/// Coordinates far below the end of the number range, so that neighbours and sizes cannot overflow.
const MAX_COORDINATE: u64 = 1 << 20;

#[derive(Deserialize)]
struct Description {
    name: String,
    kind: Option<String>,
    cells: Vec<[i32; 3]>,
    lights: Vec<[f64; 3]>,
    intensity: f64,
    resolution: Option<u64>,
    bounces: Option<u64>,
    walls: Option<Vec<([i32; 3], String)>>,
    albedo: Option<Albedo>,
    #[serde(default)]
    terms: Vec<String>,
    points: Option<Vec<[f64; 3]>>,
    shape: Vec<u64>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Albedo {
    Uniform(f64),
    PerWall(Vec<[f64; 3]>),
}

/// Reads `description`, a `.json` file, and the `.f32` file beside it.
///
/// # Errors
/// [`ReferenceError`], for the first thing wrong.
pub fn read(description: &Path) -> Result<ReferenceFile, ReferenceError> {
    let file = At(description.display().to_string());
    let io = |source| ReferenceError::Io {
        file: file.0.clone(),
        source,
    };
    let size = std::fs::metadata(description).map_err(io)?.len();
    file.limit("the file size in bytes", size, MAX_JSON_BYTES)?;
    let text = std::fs::read(description).map_err(io)?;
    let parsed: Description =
        serde_json::from_slice(&text).map_err(|error| ReferenceError::Json {
            file: file.0.clone(),
            found: shortened(error.to_string()),
        })?;
    let stem = description.file_stem().unwrap_or_default();
    if stem != parsed.name.as_str() {
        return Err(file.malformed(
            "name",
            format!("{stem:?}, as the file is named"),
            Shown(parsed.name),
        ));
    }
    let walls = check_level(&file, &parsed)?;
    let (kind, expected_shape) = check_kind(&file, &parsed, &walls)?;
    if parsed.shape != expected_shape {
        return Err(file.malformed("shape", Shown(&expected_shape), Shown(&parsed.shape)));
    }
    let count = expected_shape
        .iter()
        .try_fold(1u64, |product, &size| product.checked_mul(size))
        .unwrap_or(u64::MAX);
    file.limit("the number of values", count, MAX_VALUES)?;
    let may_be_negative = matches!(kind, Kind::RadianceSh9 { .. });
    let data = read_values(&description.with_extension("f32"), count, may_be_negative)?;
    Ok(ReferenceFile {
        name: parsed.name,
        resolution: match kind {
            Kind::RadianceSh9 { .. } => None,
            _ => parsed.resolution.map(|resolution| resolution as usize),
        },
        kind,
        cells: parsed.cells,
        walls,
        lights: parsed.lights.into_iter().map(DVec3::from_array).collect(),
        intensity: parsed.intensity,
        terms: parsed.terms,
        shape: expected_shape.iter().map(|&size| size as usize).collect(),
        data,
    })
}

/// Cells, lights and the list of walls; returns the walls that the cells imply.
fn check_level(file: &At, parsed: &Description) -> Result<Vec<(usize, Face)>, ReferenceError> {
    let cells = &parsed.cells;
    file.limit("the number of cells", cells.len() as u64, MAX_CELLS)?;
    if cells.is_empty() {
        return Err(file.malformed("cells", "at least one", "an empty list"));
    }
    for (k, cell) in cells.iter().enumerate() {
        for &x in cell {
            let size = u64::from(x.unsigned_abs());
            file.limit("a cell coordinate", size, MAX_COORDINATE)?;
        }
        if cells[..k].contains(cell) {
            let what = format!("cell {k}");
            return Err(file.malformed(what, "a cell not listed before", Shown(cell)));
        }
    }
    if parsed.lights.is_empty() {
        return Err(file.malformed("lights", "at least one", "an empty list"));
    }
    for (k, &light) in parsed.lights.iter().enumerate() {
        if cell_of(cells, DVec3::from_array(light)).is_none() {
            let what = format!("light {k}");
            return Err(file.malformed(what, "a point inside a cell", Shown(light)));
        }
    }
    if !(parsed.intensity > 0.0 && parsed.intensity.is_finite()) {
        return Err(file.malformed("intensity", "a finite number above 0", parsed.intensity));
    }
    let implied: Vec<(usize, Face)> = (0..cells.len())
        .flat_map(|cell| Face::ALL.map(|face| (cell, face)))
        .filter(|&(cell, face)| {
            neighbour_cell(cells[cell], face).is_none_or(|across| !cells.contains(&across))
        })
        .collect();
    let Some(walls) = &parsed.walls else {
        return Ok(implied);
    };
    for (k, (cell, face)) in walls.iter().enumerate() {
        let what = format!("wall {k}");
        if Face::from_name(face).is_none() {
            return Err(file.malformed(what, "a face -x, +x, -y, +y, -z or +z", Shown(face)));
        }
        if !cells.contains(cell) {
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
    Ok(implied)
}

/// The kind and the shape that follows from it.
fn check_kind(
    file: &At,
    parsed: &Description,
    walls: &[(usize, Face)],
) -> Result<(Kind, Vec<u64>), ReferenceError> {
    let lights = parsed.lights.len() as u64;
    let on_walls = || -> Result<[u64; 3], ReferenceError> {
        if parsed.walls.is_none() {
            return Err(file.malformed("walls", "a list", "absent"));
        }
        let resolution = parsed.resolution.unwrap_or(0);
        file.limit("resolution", resolution, MAX_RESOLUTION)?;
        if resolution == 0 {
            return Err(file.malformed("resolution", "at least 1", "0 or absent"));
        }
        Ok([walls.len() as u64, resolution, resolution])
    };
    let two_terms = || match parsed.terms.len() {
        2 => Ok(2),
        found => Err(file.malformed("the number of terms", 2, found)),
    };
    match parsed.kind.as_deref() {
        None | Some("irradiance") => {
            let [walls, v, u] = on_walls()?;
            let Some(terms) = parsed.bounces.and_then(|bounces| bounces.checked_add(1)) else {
                return Err(file.malformed("bounces", "a count", "absent or too large"));
            };
            Ok((Kind::Irradiance, vec![lights, terms, walls, v, u]))
        }
        Some("irradiance_rgb") => {
            let [wall_count, v, u] = on_walls()?;
            let Some(Albedo::PerWall(albedo)) = &parsed.albedo else {
                return Err(file.malformed("albedo", "one colour for each wall", "another form"));
            };
            if albedo.len() != walls.len() {
                return Err(file.malformed("the number of albedos", walls.len(), albedo.len()));
            }
            for (k, rgb) in albedo.iter().enumerate() {
                rgb.iter()
                    .try_for_each(|&a| file.albedo(format!("albedo of wall {k}"), a))?;
            }
            let kind = Kind::IrradianceRgb {
                albedo: albedo.clone(),
            };
            Ok((kind, vec![lights, two_terms()?, wall_count, v, u, 3]))
        }
        Some("radiance_sh9") => {
            let Some(Albedo::Uniform(albedo)) = parsed.albedo else {
                return Err(file.malformed("albedo", "one number", "another form"));
            };
            file.albedo("albedo".into(), albedo)?;
            let points: Vec<DVec3> = match &parsed.points {
                Some(points) if !points.is_empty() => {
                    points.iter().copied().map(DVec3::from_array).collect()
                }
                _ => return Err(file.malformed("points", "at least one", "an empty list")),
            };
            for (k, &point) in points.iter().enumerate() {
                if cell_of(&parsed.cells, point).is_none() {
                    let what = format!("point {k}");
                    return Err(file.malformed(what, "a point inside a cell", point));
                }
            }
            let shape = vec![lights, two_terms()?, points.len() as u64, 9];
            Ok((Kind::RadianceSh9 { albedo, points }, shape))
        }
        Some(other) => {
            let expected = "irradiance (or absent), irradiance_rgb or radiance_sh9";
            Err(file.malformed("kind", expected, Shown(other)))
        }
    }
}

fn read_values(path: &Path, count: u64, may_be_negative: bool) -> Result<Vec<f32>, ReferenceError> {
    let file = At(path.display().to_string());
    let io = |source| ReferenceError::Io {
        file: file.0.clone(),
        source,
    };
    let check_size = |found: u64| {
        if found == count * 4 {
            Ok(())
        } else {
            Err(file.malformed("the file size in bytes", count * 4, found))
        }
    };
    // Before reading, so that a file of any size costs nothing, and after, in case it changed.
    check_size(std::fs::metadata(path).map_err(io)?.len())?;
    let bytes = std::fs::read(path).map_err(io)?;
    check_size(bytes.len() as u64)?;
    let (words, _) = bytes.as_chunks::<4>();
    let values: Vec<f32> = words.iter().map(|&word| f32::from_le_bytes(word)).collect();
    let is_allowed = |x: f32| x.is_finite() && (may_be_negative || x >= 0.0);
    match values.iter().position(|&x| !is_allowed(x)) {
        None => Ok(values),
        Some(k) => {
            let expected = if may_be_negative {
                "a finite number"
            } else {
                "a finite number of at least 0"
            };
            Err(file.malformed(format!("value {k}"), expected, values[k]))
        }
    }
}

/// The file that errors are about.
struct At(String);

impl At {
    fn malformed(
        &self,
        what: impl Display,
        expected: impl Display,
        found: impl Display,
    ) -> ReferenceError {
        ReferenceError::Malformed {
            file: self.0.clone(),
            what: what.to_string(),
            expected: expected.to_string(),
            found: shortened(found.to_string()),
        }
    }

    fn limit(&self, what: &str, found: u64, limit: u64) -> Result<(), ReferenceError> {
        if found <= limit {
            return Ok(());
        }
        Err(ReferenceError::LimitExceeded {
            file: self.0.clone(),
            what: what.into(),
            limit,
            found,
        })
    }

    fn albedo(&self, what: String, albedo: f64) -> Result<(), ReferenceError> {
        if (0.0..=1.0).contains(&albedo) {
            return Ok(());
        }
        Err(self.malformed(what, "a number from 0 to 1", albedo))
    }
}

/// A file's own text may be megabytes long; a message should not be.
fn shortened(text: String) -> String {
    const LONGEST: usize = 80;
    if text.chars().count() <= LONGEST {
        return text;
    }
    let start: String = text.chars().take(LONGEST).collect();
    format!("{start}...")
}

/// Displays as `Debug` does: lists with brackets, text with quotes.
struct Shown<T>(T);

impl<T: Debug> Display for Shown<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}
