//! A camera that looks into a level from above. Walls that turn their back to it are not there, as in a doll's house.
//!
//! A game draws the walls as triangles instead: a vertex at (u, v) of a wall takes its place from
//! [`Block::canonical_warp`](mrt_runtime::blocks::Block::canonical_warp), and its texture coordinate from
//! [`Lightmap::texture_coordinate`](mrt_runtime::Lightmap::texture_coordinate).

use super::bilinear;
use super::picture::Picture;
use mrt_runtime::blocks::Face;
use mrt_runtime::glam::{Vec3, vec3};
use mrt_runtime::{BlockIndex, Frame, Level};
use std::f32::consts::PI;

/// A place to look from.
#[derive(Clone, Copy)]
pub struct Camera {
    pub eye: Vec3,
    pub target: Vec3,
    /// Half the picture's width over its distance.
    pub zoom: f32,
    pub width: usize,
    pub height: usize,
}

impl Camera {
    /// Looks down on all of a level whose floor is `size` metres along x and z, from (0, 0) on.
    pub fn above(size: [f32; 2], pixels: [usize; 2]) -> Self {
        let center = vec3(0.5 * size[0], 0.3, 0.5 * size[1]);
        let distance = 2.0 + 1.15 * size[0].max(size[1] * pixels[0] as f32 / pixels[1] as f32);
        Self {
            eye: center + distance * vec3(0.0, 0.85, 0.53),
            target: center,
            zoom: 0.38,
            width: pixels[0],
            height: pixels[1],
        }
    }
}

/// Which light a picture shows.
#[derive(Clone, Copy, PartialEq)]
pub enum Shown {
    Indirect,
    DirectAndIndirect,
}

/// What else a ray may meet: its distance, and the light that comes from there.
pub type Hit = Option<(f32, Vec3)>;

/// A wall of a block: the point at (u, v) is `origin + u * along_u + v * along_v`.
struct Wall {
    block: BlockIndex,
    face: Face,
    first_texel: usize,
    origin: Vec3,
    along_u: Vec3,
    along_v: Vec3,
    /// Into the block.
    normal: Vec3,
    albedo: Vec3,
}

fn walls(level: &Level, resolution: usize) -> Vec<Wall> {
    let mut walls = Vec::new();
    for (index, block) in level.blocks.iter().enumerate() {
        let warp = block.canonical_warp();
        let at = |face: Face, u, v| warp.point(face.point(u, v)).as_vec3();
        walls.extend(block.shape.walls().map(|face| {
            let origin = at(face, 0.0, 0.0);
            let (along_u, along_v) = (at(face, 1.0, 0.0) - origin, at(face, 0.0, 1.0) - origin);
            let normal = along_u.cross(along_v).normalize();
            let inward = warp.center().as_vec3() - origin;
            Wall {
                block: BlockIndex::new(index),
                face,
                first_texel: block.shape.wall_offset(face, resolution).unwrap_or(0),
                origin,
                along_u,
                along_v,
                normal: normal * normal.dot(inward).signum(),
                albedo: block.albedo[block.orientation.face(face).index()],
            }
        }));
    }
    walls
}

/// Draws a level with the light of a frame, and whatever else `thing` finds on the ray from a point along a direction.
pub fn draw(
    level: &Level,
    frame: &Frame,
    camera: Camera,
    shown: Shown,
    thing: impl Fn(Vec3, Vec3) -> Hit,
) -> Picture {
    let walls = walls(level, frame.scene().resolution());
    let forward = (camera.target - camera.eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let down = forward.cross(right);
    let ray = |x: f32, y: f32| {
        let (width, height) = (camera.width as f32, camera.height as f32);
        let (x, y) = (2.0 * x / width - 1.0, (2.0 * y - height) / width);
        let direction = forward + camera.zoom * (x * right + y * down);
        let mut nearest = thing(camera.eye, direction).map_or(f32::INFINITY, |(t, _)| t);
        let mut seen = None;
        for wall in &walls {
            let facing = direction.dot(wall.normal);
            if facing >= 0.0 {
                continue;
            }
            let t = (wall.origin - camera.eye).dot(wall.normal) / facing;
            let inside = camera.eye + t * direction - wall.origin;
            let u = inside.dot(wall.along_u) / wall.along_u.length_squared();
            let v = inside.dot(wall.along_v) / wall.along_v.length_squared();
            let is_on_wall = (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v);
            if is_on_wall && t > 0.0 && t < nearest {
                nearest = t;
                seen = Some((wall, u, v));
            }
        }
        match seen {
            Some((wall, u, v)) => wall.albedo / PI * irradiance(frame, wall, [u, v], shown),
            None => thing(camera.eye, direction).map_or(Vec3::splat(0.01), |(_, light)| light),
        }
    };
    // Four rays a pixel smooth the edges.
    Picture::new(camera.width, camera.height, |x, y| {
        let offsets = [[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]];
        let rays = offsets.map(|[right, down]| ray(x + right, y + down));
        rays.into_iter().sum::<Vec3>() / 4.0
    })
}

/// Light at a point of a wall. Indirect light comes from the lightmap, as in a game. Games compute direct light with
/// shadow maps of their own; here it comes from the texels that the frame lit in order to bounce their light.
fn irradiance(frame: &Frame, wall: &Wall, [u, v]: [f32; 2], shown: Shown) -> Vec3 {
    let lightmap = frame.lightmap();
    let coordinate = lightmap.texture_coordinate(wall.block, wall.face, u, v);
    let indirect = coordinate.map_or(Vec3::ZERO, |at| Vec3::from(lightmap.sample(at)));
    match shown {
        Shown::Indirect => indirect,
        Shown::DirectAndIndirect => indirect + direct(frame, wall, [u, v]),
    }
}

/// Direct light between the four nearest texels of a wall.
fn direct(frame: &Frame, wall: &Wall, [u, v]: [f32; 2]) -> Vec3 {
    let n = frame.scene().resolution();
    bilinear(n, [u, v], |row, column| {
        let texel = wall.first_texel + row * n + column;
        frame.direct_at(wall.block, texel).unwrap_or(Vec3::ZERO)
    })
}

/// Distance, in lengths of `direction`, at which a ray meets a ball.
pub fn ball(eye: Vec3, direction: Vec3, center: Vec3, radius: f32) -> Option<f32> {
    let from = eye - center;
    let half = from.dot(direction) / direction.length_squared();
    let rest = (from.length_squared() - radius * radius) / direction.length_squared();
    let root = half * half - rest;
    (root >= 0.0 && half < 0.0).then(|| -half - root.sqrt())
}

/// A torch: a small ball that shines.
pub fn torch(center: Vec3) -> impl Fn(Vec3, Vec3) -> Hit {
    move |eye, direction| {
        let distance = ball(eye, direction, center, 0.07)?;
        Some((distance, vec3(4.0, 3.0, 1.6)))
    }
}

/// Distance, in lengths of `direction`, at which a ray enters a cuboid between two corners.
pub fn cuboid(eye: Vec3, direction: Vec3, low: Vec3, high: Vec3) -> Option<f32> {
    let (to_low, to_high) = ((low - eye) / direction, (high - eye) / direction);
    let enters = to_low.min(to_high).max_element();
    let leaves = to_low.max(to_high).min_element();
    (enters < leaves && enters > 0.0).then_some(enters)
}

/// Whichever of two things a ray meets first.
pub fn nearer(a: Hit, b: Hit) -> Hit {
    match (a, b) {
        (Some(a), Some(b)) => Some(if a.0 < b.0 { a } else { b }),
        (a, b) => a.or(b),
    }
}
