//! Free space as voxels: which points of a regular grid stand inside the level's rooms.
//!
//! Level meshes are open, their faces meet in T-junctions, and solid rock is whatever lies behind the faces; counting
//! crossings of a ray (odd means inside) fails on all of that. Instead every triangle is projected along the three axes
//! onto the rows of voxel centres, which lists all crossings of every row with the side from which they are seen. A voxel
//! is free when it sees fronts of faces around it and stands above one. Neighbours are linked when no triangle crosses the
//! line between their centres.

use glam::{DVec3, Vec3};

/// Tests of a triangle against a row of voxels along one axis, at most. Levels have a few million; a pile of triangles as
/// large as the scene would fill the memory.
pub const MOST_CROSSINGS: usize = 100_000_000;

/// A regular grid of cubes.
#[derive(Clone, Debug)]
pub struct VoxelGrid {
    /// Smallest corner, metres.
    pub min: DVec3,
    /// Edge of a voxel, metres.
    pub edge: f64,
    /// Voxels along x, y and z.
    pub count: [usize; 3],
}

/// Which side of the triangles faces the rooms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Winding {
    /// Counter-clockwise seen from the room, or the reverse if that encloses far more.
    Auto,
    /// Counter-clockwise seen from the room.
    Front,
    /// Clockwise seen from the room.
    Back,
    /// Both sides face rooms.
    Both,
}

/// Free voxels and the links between them.
#[derive(Clone, Debug)]
pub struct FreeSpace {
    /// Where the voxels are.
    pub grid: VoxelGrid,
    /// True inside rooms.
    pub free: Vec<bool>,
    /// By axis and voxel: the coordinate at which a triangle cuts the line to the next voxel along the axis, NaN when none
    /// does.
    pub cut: [Vec<f32>; 3],
    /// Height of the next surface below each voxel, -infinity when there is none.
    pub floor: Vec<f32>,
    /// Height of the next surface above each voxel, +infinity when there is none.
    pub ceiling: Vec<f32>,
    /// True when the faces were found to be turned away from the rooms.
    pub is_reversed: bool,
}

/// A triangle crosses a row of voxel centres.
#[derive(Clone, Copy)]
struct Crossing {
    coordinate: f32,
    /// True when the face is seen by a look along the axis, false when it is seen by a look back.
    is_front: bool,
}

impl VoxelGrid {
    /// A grid around `min`..`max` with one voxel to spare on each side.
    pub fn around(min: Vec3, max: Vec3, edge: f64) -> Self {
        let size = (max - min).as_dvec3();
        // An odd fraction of a voxel: modelled planes lie on round numbers, and a row that runs inside a plane does not
        // cross it.
        let start = min.as_dvec3() - DVec3::new(1.317, 1.273, 1.351) * edge;
        Self {
            min: start,
            edge,
            count: std::array::from_fn(|axis| (size[axis] / edge).ceil() as usize + 3),
        }
    }

    /// Number of voxels.
    pub fn voxel_count(&self) -> usize {
        self.count.iter().product()
    }

    /// Index of a voxel: x fastest, then z, then y.
    pub fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (y * self.count[2] + z) * self.count[0] + x
    }

    /// Distance in indices to the next voxel along an axis.
    pub fn stride(&self, axis: usize) -> usize {
        [1, self.count[0] * self.count[2], self.count[0]][axis]
    }

    /// Coordinate of a voxel's centre along an axis, metres.
    pub fn center(&self, axis: usize, position: usize) -> f64 {
        self.min[axis] + (position as f64 + 0.5) * self.edge
    }

    /// Coordinate of a voxel's lower side along an axis, metres.
    pub fn boundary(&self, axis: usize, position: usize) -> f64 {
        self.min[axis] + position as f64 * self.edge
    }
}

impl FreeSpace {
    /// True when both the voxel and the next along the axis are free with nothing between them.
    pub fn is_linked(&self, index: usize, axis: usize) -> bool {
        let next = index + self.grid.stride(axis);
        self.free[index] && self.free[next] && self.cut[axis][index].is_nan()
    }

    /// Number of free voxels.
    pub fn free_count(&self) -> usize {
        self.free.iter().filter(|&&free| free).count()
    }
}

/// Finds the free voxels among triangles given by their corners; `None` above [`MOST_CROSSINGS`].
pub fn find_free_space(
    triangles: &[[Vec3; 3]],
    grid: VoxelGrid,
    winding: Winding,
) -> Option<FreeSpace> {
    let count = grid.voxel_count();
    let mut space = FreeSpace {
        grid,
        free: Vec::new(),
        cut: std::array::from_fn(|_| vec![f32::NAN; count]),
        floor: vec![f32::NEG_INFINITY; count],
        ceiling: vec![f32::INFINITY; count],
        is_reversed: false,
    };
    let mut sight = vec![Sight::default(); count];
    for axis in 0..3 {
        let rows = crossings_by_row(triangles, &space.grid, axis)?;
        scan_rows(&rows, axis, &mut space, &mut sight);
    }
    let front = || sight.iter().map(Sight::is_free).collect::<Vec<_>>();
    let back = || sight.iter().map(|s| s.reversed().is_free()).collect();
    let both = || sight.iter().map(|s| s.two_sided().is_free()).collect();
    space.free = match winding {
        Winding::Front => front(),
        Winding::Back => back(),
        Winding::Both => both(),
        Winding::Auto => {
            let (front, back): (_, Vec<bool>) = (front(), back());
            let volume = |free: &[bool]| free.iter().filter(|&&free| free).count();
            // Solid rock between rooms sees the backs of faces and can be several times the rooms' size.
            space.is_reversed = volume(&front) * 20 < volume(&back);
            if space.is_reversed { back } else { front }
        }
    };
    for _ in 0..2 {
        smooth(&mut space);
    }
    Some(space)
}

/// What a voxel sees along the six axis directions.
#[derive(Clone, Copy, Default)]
struct Sight {
    fronts: u8,
    backs: u8,
    below_is_front: bool,
    below_is_back: bool,
}

impl Sight {
    /// A room has a floor below and walls on most sides; it may be open to the sky or to one side.
    fn is_free(&self) -> bool {
        self.below_is_front && self.fronts >= self.backs + 3
    }

    fn reversed(self) -> Self {
        Self {
            fronts: self.backs,
            backs: self.fronts,
            below_is_front: self.below_is_back,
            below_is_back: self.below_is_front,
        }
    }

    fn two_sided(self) -> Self {
        Self {
            fronts: self.fronts + self.backs,
            backs: 0,
            below_is_front: self.below_is_front || self.below_is_back,
            below_is_back: false,
        }
    }

    fn add(&mut self, is_front: bool) {
        if is_front {
            self.fronts += 1;
        } else {
            self.backs += 1;
        }
    }
}

/// The two axes across `axis`, in an order that keeps handedness.
fn plane_axes(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// Projects every triangle along `axis`, and lists its crossings by row, with index `i + j * count[a]` for position i and j
/// along the two axes a and b across. `None` above [`MOST_CROSSINGS`].
fn crossings_by_row(
    triangles: &[[Vec3; 3]],
    grid: &VoxelGrid,
    axis: usize,
) -> Option<Vec<Vec<Crossing>>> {
    let [a, b] = plane_axes(axis);
    let mut rows = vec![Vec::new(); grid.count[a] * grid.count[b]];
    let mut tests = 0;
    for corners in triangles {
        let corners = corners.map(|corner| corner.as_dvec3());
        // Twice the projected area; positive when the normal points along +axis.
        let area = (corners[1] - corners[0]).cross(corners[2] - corners[0])[axis];
        if area == 0.0 || !area.is_finite() {
            continue;
        }
        let range = |side: usize| {
            let low = corners.iter().map(|c| c[side]).fold(f64::MAX, f64::min);
            let high = corners.iter().map(|c| c[side]).fold(f64::MIN, f64::max);
            let first = ((low - grid.min[side]) / grid.edge - 0.5).ceil().max(0.0) as usize;
            let last = ((high - grid.min[side]) / grid.edge - 0.5).floor();
            let end = (last + 1.0).clamp(0.0, grid.count[side] as f64) as usize;
            first..end
        };
        let (columns, lines) = (range(a), range(b));
        tests += columns.len() * lines.len();
        if tests > MOST_CROSSINGS {
            return None;
        }
        for j in lines {
            for i in columns.clone() {
                let point = [grid.center(a, i), grid.center(b, j)];
                // Barycentric weights; edges belong to both triangles, so that no row slips between.
                let mut coordinate = 0.0;
                let mut is_inside = true;
                for k in 0..3 {
                    let (p, q) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
                    let weight = ((p[a] - point[0]) * (q[b] - point[1])
                        - (p[b] - point[1]) * (q[a] - point[0]))
                        / area;
                    is_inside &= weight >= -1e-9;
                    coordinate += weight * corners[k][axis];
                }
                if is_inside {
                    rows[i + j * grid.count[a]].push(Crossing {
                        coordinate: coordinate as f32,
                        is_front: area < 0.0,
                    });
                }
            }
        }
    }
    Some(rows)
}

/// Tells every voxel of every row what lies before and behind it.
fn scan_rows(rows: &[Vec<Crossing>], axis: usize, space: &mut FreeSpace, sight: &mut [Sight]) {
    let [a, b] = plane_axes(axis);
    let grid = space.grid.clone();
    // Two faces of one thin wall: nearer to each other than this, each is seen from its own side.
    let same = grid.edge as f32 * 1e-2;
    let mut sorted = Vec::new();
    for (row, crossings) in rows.iter().enumerate() {
        sorted.clear();
        sorted.extend_from_slice(crossings);
        sorted.sort_by(|p, q| p.coordinate.total_cmp(&q.coordinate));
        let mut position = [0; 3];
        position[a] = row % grid.count[a];
        position[b] = row / grid.count[a];
        let mut next = 0;
        for step in 0..grid.count[axis] {
            position[axis] = step;
            let index = grid.index(position);
            let here = grid.center(axis, step) as f32;
            while sorted.get(next).is_some_and(|c| c.coordinate < here) {
                next += 1;
            }
            if let Some(ahead) = sorted.get(next) {
                let near = sorted[next..]
                    .iter()
                    .take_while(|c| c.coordinate <= ahead.coordinate + same);
                sight[index].add(near.into_iter().any(|c| c.is_front));
                if f64::from(ahead.coordinate) < grid.center(axis, step + 1) {
                    space.cut[axis][index] = ahead.coordinate;
                }
                if axis == 1 {
                    space.ceiling[index] = ahead.coordinate;
                }
            }
            if let Some(behind) = next.checked_sub(1).map(|k| sorted[k]) {
                let mut near = sorted[..next]
                    .iter()
                    .rev()
                    .take_while(|c| c.coordinate >= behind.coordinate - same);
                let is_front = near.any(|c| !c.is_front);
                sight[index].add(is_front);
                if axis == 1 {
                    space.floor[index] = behind.coordinate;
                    sight[index].below_is_front = is_front;
                    sight[index].below_is_back = !is_front;
                }
            }
        }
    }
}

/// Frees voxels most of whose linked neighbours are free, and fills those with hardly any: lone faults come from faces that
/// are modelled from one side only.
fn smooth(space: &mut FreeSpace) {
    let grid = space.grid.clone();
    let before = space.free.clone();
    let [nx, ny, nz] = grid.count;
    for y in 1..ny - 1 {
        for z in 1..nz - 1 {
            for x in 1..nx - 1 {
                let index = grid.index([x, y, z]);
                let mut free_neighbours = 0;
                for axis in 0..3 {
                    let stride = grid.stride(axis);
                    let ahead = before[index + stride] && space.cut[axis][index].is_nan();
                    let behind = before[index - stride] && space.cut[axis][index - stride].is_nan();
                    free_neighbours += usize::from(ahead) + usize::from(behind);
                }
                if before[index] && free_neighbours <= 1 {
                    space.free[index] = false;
                } else if !before[index] && free_neighbours >= 4 {
                    space.free[index] = true;
                }
            }
        }
    }
}
