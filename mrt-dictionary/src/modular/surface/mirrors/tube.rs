//! The mirrors of round tubes, acting on their texels.

use crate::modular::surface::walls::tube::TubeWall;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::TubeForm;
use mrt_core::linalg::parity::ParityClasses;

/// Parity classes of the texels: under the mirrors of x, y and z for the straight tube (eight classes), under the mirror
/// of y and the exchange of x and z for the bend (four).
pub fn tube_parity_classes(wall: &TubeWall) -> ParityClasses {
    let across = |axis| across_mirror(wall, axis);
    let last = wall.resolution - 1;
    // The mirror of x, or the bend's exchange of x and z: both reverse the way along the tube.
    let ends = chart_permutation(wall, |chart, j, i| (chart, j, last - i));
    let mirrors = match wall.form {
        TubeForm::Straight => vec![ends, across(1), across(2)],
        TubeForm::Bend => vec![across(1), ends],
    };
    ParityClasses::new(wall.texels.len(), &mirrors)
}

/// Parity classes under those mirrors that also keep each opening where it is: the mirrors of y and z for the straight
/// tube (four classes), the mirror of y for the bend (two).
pub fn tube_entry_parity_classes(wall: &TubeWall) -> ParityClasses {
    let across = |axis| across_mirror(wall, axis);
    let mirrors = match wall.form {
        TubeForm::Straight => vec![across(1), across(2)],
        TubeForm::Bend => vec![across(1)],
    };
    ParityClasses::new(wall.texels.len(), &mirrors)
}

/// A mirror across the tube: it exchanges the charts on its axis and reverses the others.
fn across_mirror(wall: &TubeWall, axis: usize) -> Vec<u32> {
    let last = wall.resolution - 1;
    chart_permutation(wall, |chart, j, i| {
        if chart.axis() == axis {
            (chart.opposite(), j, i)
        } else {
            (chart, last - j, i)
        }
    })
}

/// Where each texel goes under a map of (chart, row, column).
fn chart_permutation(
    wall: &TubeWall,
    image: impl Fn(Face, usize, usize) -> (Face, usize, usize),
) -> Vec<u32> {
    let images = wall.texels.iter().map(|texel| {
        let [j, i] = texel.row_column;
        let (chart, j, i) = image(texel.chart, j, i);
        wall.index(chart, j, i) as u32
    });
    images.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_straight_tube_has_eight_classes_and_the_bend_four() {
        let count = |form| tube_parity_classes(&TubeWall::new(form, 4)).class_count();
        assert_eq!(TubeForm::ALL.map(count), [8, 4]);
        let count = |form| tube_entry_parity_classes(&TubeWall::new(form, 4)).class_count();
        assert_eq!(TubeForm::ALL.map(count), [4, 2]);
    }
}
