//! Procedural shapes: seeded objects of many families, sampled at any density, with no download.
//!
//! Each family is a function that draws an object from parts with random proportions
//! ([`FAMILIES`]). A new family is one function and one line in that list.

use std::path::Path;
use std::sync::OnceLock;

use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use srrf_cloud::{PointCloud, UnitSphere};

use crate::datasets::{Catalogue, Entry, Listed, SourceError, checked};

mod family;
mod lathe;
mod loft;
mod polygon;
mod prism;
mod sketch;
mod surface;

mod tube;

mod abstracts;
mod animals;
mod appliances;
mod buildings;
mod furniture;
mod lamps;
mod nature;
mod seating;
mod tools;
mod vehicles;
mod vessels;

pub use family::{FAMILIES, ShapeFamily};
use sketch::Sketch;
use surface::Surface;

/// Points from which the centre and radius of a shape are estimated.
const FRAME_POINTS: usize = 4096;

/// Mixed into the seed of those points, so that no sampling repeats them.
const FRAME_SEED: u64 = 0x5EED_F4A3;

/// A set of procedural shapes.
///
/// Shape `i` is drawn from `(seed, i)` alone, and belongs to family `i` modulo the number of
/// families. Its surface is the outer skin of a union of parts, z up; mean 0 and radius 1 as
/// estimated once from 4,096 of its points, so that all samplings of a shape share one frame. For
/// training and testing use different seeds.
///
/// Shapes are drawn anew at each call and only their names and frames are kept, so large sets take little
/// memory: 1,024 points take about 0.3 ms, and 1 ms more the first time.
#[derive(Debug)]
pub struct ProceduralShapes {
    seed: u64,
    shapes: Catalogue<Procedural>,
}

/// What a procedural shape is drawn from besides its seed and number.
#[derive(Debug)]
pub(crate) struct Procedural {
    family: &'static ShapeFamily,
    frame: OnceLock<UnitSphere>,
}

impl ProceduralShapes {
    /// `count` shapes of the named families, or of all ([`FAMILIES`]).
    ///
    /// # Errors
    /// [`SourceError::Families`] for an unknown name or an empty list, [`SourceError::NoShapes`] if
    /// `count` is 0.
    pub fn new(seed: u64, count: usize, families: Option<&[&str]>) -> Result<Self, SourceError> {
        let families: Vec<&'static ShapeFamily> = match families {
            None => FAMILIES.iter().collect(),
            Some(names) => names.iter().map(|name| find(name)).collect::<Result<_, _>>()?,
        };
        if families.is_empty() {
            return Err(unknown_family(""));
        }
        if count == 0 {
            return Err(SourceError::NoShapes);
        }
        let description = format!(
            "procedural shapes, seed {seed}: {count} shapes of {} families",
            families.len().min(count)
        );
        let shape = |index: usize| {
            let family = families[index % families.len()];
            let id = format!("{}_{:04}", family.name, index / families.len());
            let item = Procedural { family, frame: OnceLock::new() };
            Entry::new(id, family.name.to_owned(), item).symmetric(family.symmetric)
        };
        Ok(Self { seed, shapes: Catalogue::new(description, (0..count).map(shape).collect()) })
    }

    fn surface(&self, shape: &Procedural, index: usize) -> Surface {
        let mut sketch = Sketch::new(self.seed, index as u64);
        (shape.family.draw)(&mut sketch);
        sketch.finish()
    }

    /// The shape and the frame in which it has mean 0 and radius 1.
    fn normalised(
        &self,
        shape: &Entry<Procedural>,
        index: usize,
    ) -> Result<(Surface, UnitSphere), SourceError> {
        let surface = self.surface(&shape.item, index);
        let frame = match shape.item.frame.get() {
            Some(frame) => *frame,
            None => {
                let mut rng = ChaCha8Rng::seed_from_u64(self.seed ^ FRAME_SEED);
                rng.set_stream(index as u64);
                let found = points(&surface, None, shape, FRAME_POINTS, &mut rng)?.to_unit_sphere().1;
                *shape.item.frame.get_or_init(|| found)
            }
        };
        Ok((surface, frame))
    }
}

fn points(
    surface: &Surface,
    frame: Option<&UnitSphere>,
    shape: &Entry<Procedural>,
    count: usize,
    rng: &mut ChaCha8Rng,
) -> Result<PointCloud, SourceError> {
    let points = (0..count)
        .filter_map(|_| {
            let point = surface.sample(rng)?.into();
            Some(frame.map_or(point, |frame| frame.apply(&point)))
        })
        .collect();
    checked(points, Path::new("procedural shapes"), shape.id())
}

fn find(name: &str) -> Result<&'static ShapeFamily, SourceError> {
    FAMILIES.iter().find(|family| family.name == name).ok_or_else(|| unknown_family(name))
}

fn unknown_family(name: &str) -> SourceError {
    let known = FAMILIES.iter().map(|family| family.name).collect::<Vec<_>>().join(", ");
    SourceError::Families { name: name.to_owned(), known }
}

impl Listed for ProceduralShapes {
    type Item = Procedural;

    fn catalogue(&self) -> &Catalogue<Procedural> {
        &self.shapes
    }

    fn draw(
        &self,
        shape: &Entry<Procedural>,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<PointCloud, SourceError> {
        let (surface, frame) = self.normalised(shape, index)?;
        points(&surface, Some(&frame), shape, count, rng)
    }

    fn draw_two(
        &self,
        shape: &Entry<Procedural>,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError> {
        let (surface, frame) = self.normalised(shape, index)?;
        let first = points(&surface, Some(&frame), shape, count, rng)?;
        Ok((first, points(&surface, Some(&frame), shape, count, rng)?))
    }
}

#[cfg(test)]
mod tests;
