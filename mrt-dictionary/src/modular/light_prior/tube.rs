//! The light prior of round tubes: its lights, the direct light from them with shadows, and the basis of this light (Loos
//! et al. 2011, sections 4 and 6.1).

use crate::config::PriorConfig;
use crate::modular::light_prior::basis::{LightPrior, light_prior};
use crate::modular::surface::area_weights::AreaWeights;
use crate::modular::surface::walls::tube::{TubeTexel, TubeWall};
use glam::{DVec2, DVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::{TUBE_RADIUS, TubeForm};
use mrt_core::lighting::sampling::{cell_center, disk_from_square};
use mrt_core::lighting::sphere_light::sphere_light_irradiance;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;

/// The prior of a tube: samples of direct light, weighted by area and decomposed by the parity classes of its texels.
pub fn tube_light_prior(
    wall: &TubeWall,
    weights: &AreaWeights,
    classes: &ParityClasses,
    config: &PriorConfig,
) -> LightPrior {
    let samples = tube_direct_samples(wall, config);
    light_prior(&weights.weigh(&samples), classes, config.k_d)
}

/// A light of the prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeLight {
    /// Centre, in the unit cube's coordinates.
    pub position: DVec3,
    /// The opening beyond which it lies, in a straight tube attached there; `None` inside.
    pub beyond: Option<Face>,
}

/// Sphere lights in a tube and in a straight tube attached to each opening, `per_axis`³ in each.
///
/// As in cubes, the lattice has points at (i + 1) / (n + 1), with one axis along the tube and the other
/// two carried to its section by the concentric map. No light is nearer to the wall than
/// R times 2 / (n + 1) (0.114 for n = 6), and the lattice has every mirror of the tube. A cubic lattice without the
/// lights in the wall would leave a ragged edge there.
pub fn tube_prior_lights(form: TubeForm, per_axis: usize) -> Vec<TubeLight> {
    lattice(form, per_axis)
        .into_iter()
        .map(|(light, _)| light)
        .collect()
}

/// Place of a light in its lattice: cell (0 inside, 1 and 2 beyond the openings), index along, row, column.
type Place = [usize; 4];

fn lattice(form: TubeForm, per_axis: usize) -> Vec<(TubeLight, Place)> {
    let n = per_axis;
    let openings = form.openings();
    let mut lights = Vec::with_capacity(3 * n * n * n);
    for cell in 0..3usize {
        let beyond = cell.checked_sub(1).map(|k| openings[k]);
        for i in 0..n {
            let along = (i + 1) as f64 / (n + 1) as f64;
            for row in 0..n {
                for column in 0..n {
                    // Centres of n cells lie at (k + 1/2) / n, and points of the lattice at (k + 1) / (n + 1).
                    let square = cell_center(n, row, column) * (n as f64 / (n + 1) as f64);
                    let section = disk_from_square(square) * TUBE_RADIUS;
                    let position = match beyond {
                        Some(face) => beyond_opening(face, along, section),
                        None => form.point(along, section),
                    };
                    lights.push((TubeLight { position, beyond }, [cell, i, row, column]));
                }
            }
        }
    }
    lights
}

fn beyond_opening(face: Face, along: f64, section: DVec2) -> DVec3 {
    let mut point = face.point(0.5, 0.5) + face.outward() * along;
    point.y += section.y;
    // Both openings of either form are side faces, whose u runs horizontally.
    point[face.u_axis()] += section.x;
    point
}

/// Irradiance at a texel's centre from a sphere light of unit intensity and the given radius; zero where the wall hides
/// the light's centre.
pub fn tube_irradiance(
    form: TubeForm,
    texel: &TubeTexel,
    light: &TubeLight,
    light_radius: f64,
) -> f64 {
    let at = &texel.center;
    let irradiance = sphere_light_irradiance(light.position - at.position, at.normal, light_radius);
    if irradiance > 0.0 && sees(form, at.position, light) {
        irradiance
    } else {
        0.0
    }
}

fn sees(form: TubeForm, point: DVec3, light: &TubeLight) -> bool {
    let Some(face) = light.beyond else {
        return form.segment_is_free(point, light.position);
    };
    let plane = if face.is_positive() { 1.0 } else { 0.0 };
    let offset = light.position - point;
    let crossing = point + offset * ((plane - point[face.axis()]) / offset[face.axis()]);
    // The rest of the way is in a straight tube, which is convex.
    crossing.distance(face.point(0.5, 0.5)) < TUBE_RADIUS && form.segment_is_free(point, crossing)
}

/// The samples `L_d`, texels x lights, with one light for each orbit of the mirrors, scaled by the root of the
/// orbit's size.
///
/// In the coordinates of one parity class the lights of an orbit give the same column up to its sign. So
/// these few columns have the singular values and left vectors of all of them, for an eighth or a
/// quarter of the work. This holds only class by class: fold the columns of each class from this matrix, as
/// [`light_prior`] does.
pub fn tube_direct_samples(wall: &TubeWall, config: &PriorConfig) -> Matrix<f64> {
    let lights = tube_prior_lights(wall.form, config.lights_per_axis);
    let classes = light_parity_classes(wall.form, config.lights_per_axis);
    let orbits: Vec<(TubeLight, f64)> = classes
        .orbits()
        .map(|orbit| (lights[orbit[0].0 as usize], (orbit.len() as f64).sqrt()))
        .collect();
    Matrix::from_fn(wall.texels.len(), orbits.len(), |texel, k| {
        let (light, scale) = &orbits[k];
        scale * tube_irradiance(wall.form, &wall.texels[texel], light, config.light_radius)
    })
}

/// The mirrors of [`crate::modular::surface::mirrors::tube::tube_parity_classes`], acting on the lights.
fn light_parity_classes(form: TubeForm, per_axis: usize) -> ParityClasses {
    let lights = lattice(form, per_axis);
    let n = per_axis;
    let permutation = |image: &dyn Fn(Place) -> Place| -> Vec<u32> {
        let index = |[cell, i, row, column]: Place| ((cell * n + i) * n + row) * n + column;
        lights
            .iter()
            .map(|&(_, place)| index(image(place)) as u32)
            .collect()
    };
    let ends = permutation(&|[cell, i, row, column]| match cell {
        0 => [0, n - 1 - i, row, column],
        // Beyond the openings, i counts away from them.
        _ => [3 - cell, i, row, column],
    });
    let up = permutation(&|[cell, i, row, column]| [cell, i, n - 1 - row, column]);
    match form {
        TubeForm::Straight => {
            let across = permutation(&|[cell, i, row, column]| [cell, i, row, n - 1 - column]);
            ParityClasses::new(lights.len(), &[ends, up, across])
        }
        TubeForm::Bend => ParityClasses::new(lights.len(), &[up, ends]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::surface::mirrors::tube::tube_parity_classes;
    use mrt_core::linalg::svd::svd;

    const RADIUS: f64 = 0.1;

    fn all_samples(wall: &TubeWall, per_axis: usize) -> Matrix<f64> {
        let lights = tube_prior_lights(wall.form, per_axis);
        Matrix::from_fn(wall.texels.len(), lights.len(), |i, j| {
            tube_irradiance(wall.form, &wall.texels[i], &lights[j], RADIUS)
        })
    }

    #[test]
    fn lights_stand_further_from_the_wall_than_their_radius() {
        for form in TubeForm::ALL {
            let lights = tube_prior_lights(form, 6);
            assert_eq!(lights.len(), 3 * 216);
            for light in lights {
                match light.beyond {
                    None => {
                        assert!(form.contains(light.position));
                        assert!(form.wall_distance(light.position) > RADIUS);
                    }
                    Some(face) => {
                        let past = light.position - face.point(0.5, 0.5);
                        let along = past.dot(face.outward());
                        assert!(along > 0.0 && along < 1.0);
                        let across = past - face.outward() * along;
                        assert!(across.length() < TUBE_RADIUS - RADIUS);
                    }
                }
            }
        }
    }

    #[test]
    fn one_light_of_each_orbit_stands_for_all_lights() {
        for form in TubeForm::ALL {
            let wall = TubeWall::new(form, 4);
            let classes = tube_parity_classes(&wall);
            let config = PriorConfig {
                lights_per_axis: 3,
                light_radius: RADIUS,
                ..PriorConfig::default()
            };
            let few = tube_direct_samples(&wall, &config);
            let all = all_samples(&wall, config.lights_per_axis);
            for class in 0..classes.class_count() {
                let values =
                    |m: &Matrix<f64>| svd(classes.fold_columns(class, m).view()).singular_values;
                let (few, all) = (values(&few), values(&all));
                // Positions of mirrored lights differ by rounding.
                for (k, &s) in all.iter().enumerate() {
                    let found = few.get(k).copied().unwrap_or(0.0);
                    assert!((found - s).abs() < 1e-10 * all[0], "{form:?} {class} {k}");
                }
            }
        }
    }

    #[test]
    fn lights_shine_where_rays_reach_them() {
        for form in TubeForm::ALL {
            let (mut lit, mut shadowed) = (0, 0);
            for texel in TubeWall::new(form, 6).texels {
                for light in tube_prior_lights(form, 4) {
                    let offset = light.position - texel.center.position;
                    if texel.center.normal.dot(offset) <= 0.0 {
                        continue;
                    }
                    let hit = form.first_hit(texel.center.position, offset);
                    let reached = match light.beyond {
                        None => hit.distance >= 1.0,
                        Some(face) => hit.opening == Some(face),
                    };
                    assert_eq!(tube_irradiance(form, &texel, &light, RADIUS) > 0.0, reached);
                    lit += usize::from(reached);
                    shadowed += usize::from(!reached);
                }
            }
            // The straight tube and those attached to it are one convex region.
            match form {
                TubeForm::Straight => assert_eq!(shadowed, 0),
                // No light of the prior hugs the inner side: shadows are few.
                TubeForm::Bend => assert!(shadowed > 0 && shadowed < lit / 10),
            }
        }
    }
}
