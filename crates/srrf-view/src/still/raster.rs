//! [`Raster`]: discs with depth, and text, in a picture of bytes.

use std::convert::Infallible;

use embedded_graphics::mono_font::{MonoFont, MonoTextStyle};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::text::{Baseline, Text};

/// Red, green, blue.
pub type Rgb = [u8; 3];

/// An RGB picture with a depth for each pixel.
pub struct Raster {
    pub width: usize,
    pub height: usize,
    rgb: Vec<u8>,
    depth: Vec<f32>,
}

impl Raster {
    /// A picture of one colour, infinitely far away.
    pub fn new(width: usize, height: usize, background: Rgb) -> Self {
        let pixels = width * height;
        Self { width, height, rgb: background.repeat(pixels), depth: vec![f32::INFINITY; pixels] }
    }

    /// A filled disc at `[x, y]` in pixels, in front of all that is farther away. Darker at its edge, as a ball is.
    pub fn disc(&mut self, [x, y]: [f64; 2], radius: f64, depth: f32, colour: Rgb) {
        if !(x.is_finite() && y.is_finite()) {
            return;
        }
        let range = |centre: f64, size: usize| {
            let low = (centre - radius).ceil().max(0.0);
            let high = (centre + radius).floor().min(size as f64 - 1.0);
            if low <= high { low as usize..high as usize + 1 } else { 0..0 }
        };
        for row in range(y, self.height) {
            for column in range(x, self.width) {
                let share =
                    ((row as f64 - y).powi(2) + (column as f64 - x).powi(2)) / (radius * radius).max(0.25);
                let at = row * self.width + column;
                if share > 1.0 || depth >= self.depth[at] {
                    continue;
                }
                self.depth[at] = depth;
                let light = 1.0 - 0.22 * share;
                self.put(at, colour.map(|c| (f64::from(c) * light).round() as u8));
            }
        }
    }

    /// A filled rectangle, on top of everything.
    pub fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, colour: Rgb) {
        for row in y..(y + height).min(self.height) {
            for column in x..(x + width).min(self.width) {
                self.put(row * self.width + column, colour);
            }
        }
    }

    /// Text with its upper left corner at `[x, y]`.
    pub fn text(&mut self, text: &str, [x, y]: [usize; 2], font: &MonoFont<'_>, [r, g, b]: Rgb) {
        let style = MonoTextStyle::new(font, Rgb888::new(r, g, b));
        let text = Text::with_baseline(text, Point::new(x as i32, y as i32), style, Baseline::Top);
        let Ok(_) = text.draw(self); // infallible
    }

    /// Copies a picture of twice the size into the place with its upper left corner at `[x, y]`; each pixel is the mean of four.
    pub fn halve_into(&self, to: &mut Self, [x, y]: [usize; 2]) {
        for row in 0..self.height / 2 {
            for column in 0..self.width / 2 {
                let four =
                    [0, 1, self.width, self.width + 1].map(|d| 3 * (2 * row * self.width + 2 * column + d));
                let mean = std::array::from_fn(|c| {
                    (four.iter().map(|&at| u32::from(self.rgb[at + c])).sum::<u32>().div_ceil(4)) as u8
                });
                if x + column < to.width && y + row < to.height {
                    to.put((y + row) * to.width + x + column, mean);
                }
            }
        }
    }

    fn put(&mut self, pixel: usize, colour: Rgb) {
        self.rgb[3 * pixel..3 * pixel + 3].copy_from_slice(&colour);
    }

    /// The colour of a pixel.
    #[cfg(test)]
    pub fn at(&self, x: usize, y: usize) -> Rgb {
        let at = 3 * (y * self.width + x);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }

    /// The picture as a PNG file.
    pub fn to_png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.write_header()?.write_image_data(&self.rgb)?;
        Ok(bytes)
    }
}

impl OriginDimensions for Raster {
    fn size(&self) -> Size {
        Size::new(self.width as u32, self.height as u32)
    }
}

impl DrawTarget for Raster {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(Point { x, y }, colour) in pixels {
            if let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y))
                && x < self.width
                && y < self.height
            {
                self.put(y * self.width + x, [colour.r(), colour.g(), colour.b()]);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_disc_is_in_front_in_any_order() {
        let [near, far] = [[200, 0, 0], [0, 0, 200]];
        let draw = |order: [(f32, Rgb); 2]| {
            let mut raster = Raster::new(20, 12, [255; 3]);
            for (depth, colour) in order {
                raster.disc([8.0, 6.0], 3.0, depth, colour);
            }
            raster
        };
        let (a, b) = (draw([(1.0, near), (2.0, far)]), draw([(2.0, far), (1.0, near)]));
        assert_eq!((a.at(8, 6), b.at(8, 6), a.at(15, 6)), (near, near, [255; 3]));
        assert_eq!(a.rgb, b.rgb);
        let mut out = Raster::new(20, 12, [255; 3]);
        for at in [[-50.0, 4.0], [1e300, 4.0], [4.0, f64::NAN]] {
            out.disc(at, 3.0, 1.0, near);
        }
        assert_eq!(out.rgb, Raster::new(20, 12, [255; 3]).rgb);
    }

    #[test]
    fn half_the_size_and_back_from_a_file() {
        let mut large = Raster::new(8, 4, [0; 3]);
        large.fill(0, 0, 2, 2, [200, 100, 40]);
        let mut small = Raster::new(6, 3, [9; 3]);
        large.halve_into(&mut small, [1, 1]);
        assert_eq!((small.at(1, 1), small.at(2, 1), small.at(0, 0)), ([200, 100, 40], [0; 3], [9; 3]));
        let bytes = small.to_png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, small.rgb);
    }
}
