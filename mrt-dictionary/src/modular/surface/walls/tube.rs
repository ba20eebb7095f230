//! Texels of the wall of a round tube (Loos et al. 2011, section 6.1).

use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::{SurfacePoint, TubeForm};

/// A texel of a tube's wall.
#[derive(Clone, Copy, Debug)]
pub struct TubeTexel {
    /// Its chart.
    pub chart: Face,
    /// Row (v) and column (u) in the chart.
    pub row_column: [usize; 2],
    /// The wall at its centre.
    pub center: SurfacePoint,
    /// Its area, exactly.
    pub area: f64,
}

/// The wall of a tube, cut into texels.
#[derive(Clone, Debug)]
pub struct TubeWall {
    /// Straight or bent.
    pub form: TubeForm,
    /// Texels along an edge of a chart.
    pub resolution: usize,
    /// All texels: chart by chart as [`TubeForm::charts`] lists them, row by row, column by column.
    pub texels: Vec<TubeTexel>,
}

impl TubeWall {
    /// Cuts each of the four charts into `resolution`² texels.
    pub fn new(form: TubeForm, resolution: usize) -> Self {
        let mut texels = Vec::with_capacity(4 * resolution * resolution);
        for chart in form.charts() {
            for j in 0..resolution {
                let area = form.texel_area(chart, resolution, j);
                texels.extend((0..resolution).map(|i| TubeTexel {
                    chart,
                    row_column: [j, i],
                    center: form.texel_center(chart, resolution, j, i),
                    area,
                }));
            }
        }
        Self {
            form,
            resolution,
            texels,
        }
    }

    /// Index of the texel in row `j` (v) and column `i` (u) of a chart.
    pub fn index(&self, chart: Face, j: usize, i: usize) -> usize {
        let charts = self.form.charts();
        let chart = charts.iter().position(|&face| face == chart).unwrap_or(0);
        (chart * self.resolution + j) * self.resolution + i
    }

    /// Index of the texel that holds a point of the wall.
    pub fn texel_at(&self, point: DVec3) -> usize {
        let (chart, u, v) = self.form.chart_of(point);
        let along = |x: f64| ((x * self.resolution as f64) as usize).min(self.resolution - 1);
        self.index(chart, along(v), along(u))
    }
}

/// The direction that stands to the normal and the tangents of a point as `local` stands to +z, +x and +y.
pub fn direction_around(point: &SurfacePoint, local: DVec3) -> DVec3 {
    point.tangents[0] * local.x + point.tangents[1] * local.y + point.normal * local.z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_found_by_their_centers() {
        for form in TubeForm::ALL {
            let wall = TubeWall::new(form, 7);
            for (k, texel) in wall.texels.iter().enumerate() {
                assert_eq!(wall.texel_at(texel.center.position), k);
            }
        }
    }

    #[test]
    fn texels_cover_the_wall() {
        for form in TubeForm::ALL {
            let wall = TubeWall::new(form, 5);
            let area: f64 = wall.texels.iter().map(|texel| texel.area).sum();
            // A sum of a hundred areas.
            assert!((area - form.wall_area()).abs() < 1e-13);
        }
    }
}
