//! A page to draw figures on: text, lines and patches of colour in 8-bit sRGB.

use embedded_graphics::Drawable;
use embedded_graphics::Pixel;
use embedded_graphics::geometry::{OriginDimensions, Point, Size};
use embedded_graphics::mono_font::iso_8859_1::{
    FONT_7X13, FONT_8X13, FONT_8X13_BOLD, FONT_9X15_BOLD,
};
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle};
use embedded_graphics::pixelcolor::{Rgb888, RgbColor};
use embedded_graphics::prelude::DrawTarget;
use embedded_graphics::text::{Alignment, Baseline, Text, TextStyleBuilder};
use mrt_editor::render::Picture;
use mrt_editor::render::file::{Saves, WriteError, write_png};
use mrt_editor::render::tone::tone_map;
use std::convert::Infallible;
use std::path::Path;

/// An 8-bit sRGB colour.
pub type Colour = [u8; 3];

/// Of text and axes.
pub const INK: Colour = [38, 40, 44];
/// Of remarks.
pub const FAINT_INK: Colour = [105, 108, 114];
/// Of grids and frames.
pub const RULE: Colour = [222, 224, 228];
/// Of the page.
pub const PAPER: Colour = [255, 255, 255];

/// Okabe and Ito's colours, which people who confuse some colours can tell apart, the palest left out.
pub const SERIES: [Colour; 6] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
];

/// How text looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lettering {
    /// Of a whole figure.
    Title,
    /// Of a part of it.
    Heading,
    /// Labels.
    Label,
    /// Remarks.
    Remark,
}

impl Lettering {
    fn font(self) -> &'static MonoFont<'static> {
        match self {
            Lettering::Title => &FONT_9X15_BOLD,
            Lettering::Heading => &FONT_8X13_BOLD,
            Lettering::Label => &FONT_8X13,
            Lettering::Remark => &FONT_7X13,
        }
    }

    fn colour(self) -> Colour {
        match self {
            Lettering::Remark => FAINT_INK,
            _ => INK,
        }
    }
}

/// Where text stands at its point, which is at half its height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// To the right of the point.
    Right,
    /// Around the point.
    Middle,
    /// To the left of the point.
    Left,
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// Left edge.
    pub x: i32,
    /// Upper edge.
    pub y: i32,
    /// Pixels across.
    pub width: i32,
    /// Pixels down.
    pub height: i32,
}

/// A page.
#[derive(Clone, Debug)]
pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Colour>,
}

impl Canvas {
    /// A blank page.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            pixels: vec![PAPER; width * height],
        }
    }

    /// A page with a title and lines of remarks: the first at y = 44, the others 16 pixels apart.
    pub fn titled(size: [i32; 2], title: &str, remarks: &[&str]) -> Self {
        let [width, height] = size.map(|k| k.max(0) as usize);
        let mut page = Self::new(width, height);
        page.text([20, 22], Side::Right, Lettering::Title, title);
        for (k, remark) in (0i32..).zip(remarks) {
            page.text([20, 44 + 16 * k], Side::Right, Lettering::Remark, remark);
        }
        page
    }

    /// Pixels across and down.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Sets a pixel; one outside the page is left out.
    pub fn set(&mut self, x: i32, y: i32, colour: Colour) {
        self.blend(x, y, colour, 1.0);
    }

    fn blend(&mut self, x: i32, y: i32, colour: Colour, share: f32) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else {
            return;
        };
        if x < self.width && y < self.height {
            let pixel = &mut self.pixels[y * self.width + x];
            *pixel = mix(*pixel, colour, share);
        }
    }

    /// Fills a rectangle.
    pub fn fill(&mut self, area: Area, colour: Colour) {
        for y in area.y..area.y + area.height {
            for x in area.x..area.x + area.width {
                self.set(x, y, colour);
            }
        }
    }

    /// Outlines a rectangle from outside.
    pub fn outline(&mut self, area: Area, colour: Colour) {
        let (right, below) = (area.x + area.width, area.y + area.height);
        for x in area.x - 1..=right {
            self.set(x, area.y - 1, colour);
            self.set(x, below, colour);
        }
        for y in area.y - 1..=below {
            self.set(area.x - 1, y, colour);
            self.set(right, y, colour);
        }
    }

    /// A line with soft edges.
    pub fn line(&mut self, from: [f32; 2], to: [f32; 2], width: f32, colour: Colour) {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        let squared = (dx * dx + dy * dy).max(1e-12);
        self.cover(from, to, 0.5 * width + 1.0, colour, |x, y| {
            let along = ((x - from[0]) * dx + (y - from[1]) * dy) / squared;
            let along = along.clamp(0.0, 1.0);
            let (x, y) = (x - from[0] - along * dx, y - from[1] - along * dy);
            0.5 * width + 0.5 - (x * x + y * y).sqrt()
        });
    }

    /// A disk with a soft edge.
    pub fn disk(&mut self, at: [f32; 2], radius: f32, colour: Colour) {
        self.cover(at, at, radius + 1.0, colour, |x, y| {
            let (x, y) = (x - at[0], y - at[1]);
            radius + 0.5 - (x * x + y * y).sqrt()
        });
    }

    /// Blends a colour by a cover in [0, 1] over the box around two points, `margin` wider.
    fn cover(
        &mut self,
        a: [f32; 2],
        b: [f32; 2],
        margin: f32,
        colour: Colour,
        cover: impl Fn(f32, f32) -> f32,
    ) {
        let low = [0, 1].map(|k| (a[k].min(b[k]) - margin).floor() as i32);
        let high = [0, 1].map(|k| (a[k].max(b[k]) + margin).ceil() as i32);
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                let share = cover(x as f32 + 0.5, y as f32 + 0.5).clamp(0.0, 1.0);
                if share > 0.0 {
                    self.blend(x, y, colour, share);
                }
            }
        }
    }

    /// One line of text.
    pub fn text(&mut self, [x, y]: [i32; 2], side: Side, lettering: Lettering, text: &str) {
        self.coloured_text([x, y], side, lettering, lettering.colour(), text);
    }

    /// One line of text in a colour of its own.
    pub fn coloured_text(
        &mut self,
        [x, y]: [i32; 2],
        side: Side,
        lettering: Lettering,
        colour: Colour,
        text: &str,
    ) {
        let style = MonoTextStyle::new(
            lettering.font(),
            Rgb888::new(colour[0], colour[1], colour[2]),
        );
        let alignment = match side {
            Side::Right => Alignment::Left,
            Side::Middle => Alignment::Center,
            Side::Left => Alignment::Right,
        };
        let place = TextStyleBuilder::new()
            .alignment(alignment)
            .baseline(Baseline::Middle)
            .build();
        // Drawing here cannot fail.
        let Ok(_) = Text::with_text_style(text, Point::new(x, y), style, place).draw(self);
    }

    /// Tone maps a picture onto the page, as far as `shown` covers it (1 where it does, 0 where not).
    pub fn picture(&mut self, [x, y]: [i32; 2], picture: &Picture, shown: &Picture, exposure: f32) {
        let srgb = tone_map(picture, exposure);
        let pixels = srgb.as_chunks::<3>().0.iter().zip(&shown.pixels);
        for (k, (colour, shown)) in pixels.enumerate() {
            let (i, j) = (k % picture.width, k / picture.width);
            // At edges the picture holds the mean with black, the share that is paper.
            let colour =
                colour.map(|value| f32::from(value) + (1.0 - shown.x) * f32::from(PAPER[0]));
            self.set(
                x + i as i32,
                y + j as i32,
                colour.map(|value| value.min(255.0) as u8),
            );
        }
    }

    /// Writes the page as a small PNG file; returns its bytes.
    ///
    /// # Errors
    /// [`WriteError`].
    pub fn write(&self, path: &Path) -> Result<usize, WriteError> {
        write_png(
            path,
            [self.width, self.height],
            self.pixels.as_flattened(),
            Saves::Bytes,
        )
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.width as u32, self.height as u32)
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(
        &mut self,
        pixels: I,
    ) -> Result<(), Infallible> {
        for Pixel(at, colour) in pixels {
            self.set(at.x, at.y, [colour.r(), colour.g(), colour.b()]);
        }
        Ok(())
    }
}

/// `share` of the second colour, the rest of the first.
pub fn mix(a: Colour, b: Colour, share: f32) -> Colour {
    std::array::from_fn(|k| {
        let (a, b) = (f32::from(a[k]), f32::from(b[k]));
        (a + share * (b - a)).round() as u8
    })
}

/// Blue for -1, white for 0, red for 1; after ColorBrewer's RdBu.
pub fn diverging(value: f64) -> Colour {
    const STOPS: [Colour; 7] = [
        [5, 48, 97],
        [67, 147, 195],
        [209, 229, 240],
        [252, 252, 252],
        [253, 219, 199],
        [214, 96, 77],
        [103, 0, 31],
    ];
    let place = (3.0 + 3.0 * value).clamp(0.0, 6.0);
    let below = (place.floor() as usize).min(5);
    mix(
        STOPS[below],
        STOPS[below + 1],
        (place - below as f64) as f32,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_drawn_stays_on_the_page() {
        let mut page = Canvas::new(20, 10);
        page.line([-50.0, -50.0], [50.0, 50.0], 2.0, INK);
        page.disk([19.0, 9.0], 5.0, INK);
        page.text([18, 5], Side::Right, Lettering::Title, "beyond the edge");
        page.fill(
            Area {
                x: -3,
                y: 8,
                width: 50,
                height: 50,
            },
            RULE,
        );
        assert_eq!(page.pixels.len(), 200);
        assert_eq!(page.pixels[9 * 20], RULE);
    }

    #[test]
    fn signs_have_their_colours_and_zero_is_white() {
        let [r, _, b] = diverging(1.0);
        assert!(r > b);
        let [r, _, b] = diverging(-1.0);
        assert!(b > r);
        assert_eq!(diverging(0.0), [252, 252, 252]);
        assert_eq!(diverging(7.0), diverging(1.0));
    }
}
