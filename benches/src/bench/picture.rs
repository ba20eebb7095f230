//! Charts as SVG and as PNG.

use super::chart::{Mark, SIZE};
use crate::canvas::{Canvas, Colour, Lettering, Side};
use std::fmt::Write;

/// A chart as the text of an SVG file.
pub fn svg(marks: &[Mark]) -> String {
    let [width, height] = SIZE;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"Menlo, Consolas, 'DejaVu Sans Mono', monospace\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
    );
    for mark in marks {
        // Writing to a string cannot fail.
        let _ = match mark {
            Mark::Line {
                from: [x1, y1],
                to: [x2, y2],
                width,
                colour,
            } => writeln!(
                text,
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{}\" \
                 stroke-width=\"{width}\" stroke-linecap=\"round\"/>",
                hex(*colour)
            ),
            Mark::Disk {
                at: [x, y],
                radius,
                colour,
            } => writeln!(
                text,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{}\"/>",
                hex(*colour)
            ),
            Mark::Text {
                at: [x, y],
                side,
                lettering,
                colour,
                text: words,
            } => {
                let anchor = match side {
                    Side::Right => "start",
                    Side::Middle => "middle",
                    Side::Left => "end",
                };
                let (size, weight) = match lettering {
                    Lettering::Title => (15, "bold"),
                    Lettering::Heading => (13, "bold"),
                    Lettering::Label => (13, "normal"),
                    Lettering::Remark => (11, "normal"),
                };
                writeln!(
                    text,
                    "<text x=\"{x}\" y=\"{y}\" dy=\"0.35em\" text-anchor=\"{anchor}\" font-size=\"{size}\" \
                     font-weight=\"{weight}\" fill=\"{}\">{}</text>",
                    hex(*colour),
                    escaped(words)
                )
            }
        };
    }
    text.push_str("</svg>\n");
    text
}

fn hex([r, g, b]: Colour) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// A chart as pixels.
pub fn canvas(marks: &[Mark]) -> Canvas {
    let [width, height] = SIZE.map(|k| k as usize);
    let mut page = Canvas::new(width, height);
    for mark in marks {
        match mark {
            Mark::Line {
                from,
                to,
                width,
                colour,
            } => page.line(*from, *to, *width, *colour),
            Mark::Disk { at, radius, colour } => page.disk(*at, *radius, *colour),
            Mark::Text {
                at,
                side,
                lettering,
                colour,
                text,
            } => page.coloured_text(*at, *side, *lettering, *colour, text),
        }
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::INK;

    #[test]
    fn text_that_looks_like_markup_stays_text() {
        let mark = Mark::Text {
            at: [1, 2],
            side: Side::Right,
            lettering: Lettering::Label,
            colour: INK,
            text: "a < b & c".to_owned(),
        };
        let text = svg(&[mark]);
        assert!(text.contains(">a &lt; b &amp; c</text>"), "{text}");
        assert!(text.contains("fill=\"#26282c\""), "{text}");
    }
}
