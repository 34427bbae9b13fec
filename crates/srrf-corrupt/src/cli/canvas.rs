//! [`Canvas`]: a picture with smooth discs and text, and no need of system fonts.

use std::convert::Infallible;

use embedded_graphics::mono_font::{MonoFont, MonoTextStyle};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::text::{Baseline, Text};

/// A colour: red, green, blue.
pub type Colour = [u8; 3];

/// Part of a picture: discs are cut off at its edges.
#[derive(Debug, Clone, Copy)]
pub struct Window {
    /// Left edge, in pixels.
    pub x: i32,
    /// Upper edge.
    pub y: i32,
    /// Width.
    pub width: i32,
    /// Height.
    pub height: i32,
}

/// An RGB picture.
pub struct Canvas {
    width: u32,
    height: u32,
    rgb: Vec<u8>,
}

impl Canvas {
    /// A picture of one colour.
    pub fn new(width: u32, height: u32, background: Colour) -> Self {
        Self { width, height, rgb: background.repeat((width * height) as usize) }
    }

    /// Mixes `colour` into a pixel by `share`, 0 to 1. Pixels outside the picture are ignored.
    fn blend(&mut self, x: i32, y: i32, colour: Colour, share: f64) {
        if x < 0 || y < 0 || x >= self.width as i32 || y >= self.height as i32 {
            return;
        }
        let at = 3 * (y as usize * self.width as usize + x as usize);
        for (old, new) in self.rgb[at..at + 3].iter_mut().zip(colour) {
            *old = (f64::from(*old) + share * (f64::from(new) - f64::from(*old))).round() as u8;
        }
    }

    /// A filled disc with a smooth edge.
    pub fn disc(&mut self, window: Window, [cx, cy]: [f64; 2], radius: f64, colour: Colour) {
        let reach = radius + 1.0;
        let bound = |low: f64, high: f64, start: i32, length: i32| {
            (low.floor() as i32).max(start)..(high.ceil() as i32 + 1).min(start + length)
        };
        for y in bound(cy - reach, cy + reach, window.y, window.height) {
            for x in bound(cx - reach, cx + reach, window.x, window.width) {
                let distance = (f64::from(x) - cx).hypot(f64::from(y) - cy);
                self.blend(x, y, colour, (radius + 0.5 - distance).clamp(0.0, 1.0));
            }
        }
    }

    /// A filled rectangle.
    pub fn fill(&mut self, window: Window, colour: Colour) {
        for y in window.y..window.y + window.height {
            for x in window.x..window.x + window.width {
                self.blend(x, y, colour, 1.0);
            }
        }
    }

    /// Text with its upper left corner at `[x, y]`; ASCII.
    pub fn text(&mut self, text: &str, [x, y]: [i32; 2], font: &MonoFont<'_>, [r, g, b]: Colour) {
        let style = MonoTextStyle::new(font, Rgb888::new(r, g, b));
        let text = Text::with_baseline(text, Point::new(x, y), style, Baseline::Top);
        let Ok(_) = text.draw(self); // infallible
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    /// The encoder's, for a picture without pixels.
    pub fn to_png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        encoder.write_header()?.write_image_data(&self.rgb)?;
        Ok(bytes)
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(at, colour) in pixels {
            self.blend(at.x, at.y, [colour.r(), colour.g(), colour.b()], 1.0);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_graphics::mono_font::ascii::FONT_9X15;

    const WHITE: Colour = [255; 3];

    fn dark(canvas: &Canvas) -> f64 {
        canvas.rgb.chunks(3).map(|p| 1.0 - f64::from(p[0]) / 255.0).sum()
    }

    #[test]
    fn a_disc_has_its_area_and_stays_in_its_window() {
        let window = Window { x: 0, y: 0, width: 40, height: 30 };
        let mut canvas = Canvas::new(40, 30, WHITE);
        canvas.disc(window, [20.3, 15.1], 7.0, [0; 3]);
        let area = std::f64::consts::PI * 49.0;
        assert!((dark(&canvas) / area - 1.0).abs() < 0.02, "{}", dark(&canvas));
        canvas.disc(Window { width: 10, ..window }, [-900.0, 15.0], 3.0, [0; 3]);
        let mut cut = Canvas::new(40, 30, WHITE);
        cut.disc(Window { width: 10, ..window }, [10.0, 15.0], 7.0, [0; 3]);
        assert!(cut.rgb.chunks(120).all(|row| row[30..].iter().all(|c| *c == 255)));
    }

    #[test]
    fn text_leaves_ink_and_the_file_is_a_png() {
        let mut canvas = Canvas::new(60, 20, WHITE);
        canvas.text("shear", [2, 2], &FONT_9X15, [0; 3]);
        assert!(dark(&canvas) > 50.0);
        canvas.text("cut off at the edge", [50, 10], &FONT_9X15, [0; 3]);
        let bytes = canvas.to_png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, canvas.rgb);
    }
}
