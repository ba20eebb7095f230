//! A pinhole camera.

use glam::Vec3;

/// Where a picture is taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// World position, metres.
    pub position: Vec3,
    forward: Vec3,
    right: Vec3,
    down: Vec3,
}

impl Camera {
    /// Looks from one point to another, +Y upwards, metres; the angle of view is vertical, and `aspect` is width over
    /// height. `None` if the points coincide or are not finite.
    pub fn look_at(from: Vec3, to: Vec3, view_angle_rad: f32, aspect: f32) -> Option<Self> {
        let forward = (to - from).try_normalize().filter(|f| f.is_finite())?;
        // When the camera looks straight up or down, any horizontal direction may be to the right.
        let right = forward.cross(Vec3::Y).try_normalize().unwrap_or(Vec3::X);
        let half = (view_angle_rad / 2.0).tan();
        Some(Self {
            position: from,
            forward,
            right: right * half * aspect,
            down: forward.cross(right) * half,
        })
    }

    /// Unit direction through the picture's (x, y) in [0, 1]², from the top left.
    pub fn direction(&self, x: f32, y: f32) -> Vec3 {
        let (x, y) = (2.0 * x - 1.0, 2.0 * y - 1.0);
        (self.forward + self.right * x + self.down * y).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_top_of_the_picture_is_up_and_its_right_side_to_the_right() {
        let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, 1.0, 1.0).expect("looks");
        assert!(camera.direction(0.5, 0.0).y > 0.4);
        assert!(camera.direction(1.0, 0.5).x > 0.4);
        assert_eq!(Camera::look_at(Vec3::X, Vec3::X, 1.0, 1.0), None);
        assert!(Camera::look_at(Vec3::ZERO, Vec3::Y, 1.0, 1.0).is_some());
    }
}
