//! The list of families.

use std::fmt;

use super::sketch::Sketch;
use super::{
    abstracts, animals, appliances, buildings, furniture, lamps, nature, seating, tools, vehicles, vessels,
};

/// A family of procedural shapes.
#[non_exhaustive]
pub struct ShapeFamily {
    /// Its name, which is the class of its shapes.
    pub name: &'static str,
    /// Whether its shapes are symmetric about an axis.
    pub symmetric: bool,
    pub(super) draw: fn(&mut Sketch),
}

impl fmt::Debug for ShapeFamily {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ShapeFamily").field("name", &self.name).field("symmetric", &self.symmetric).finish()
    }
}

const fn family(name: &'static str, draw: fn(&mut Sketch)) -> ShapeFamily {
    ShapeFamily { name, symmetric: false, draw }
}

const fn symmetric(name: &'static str, draw: fn(&mut Sketch)) -> ShapeFamily {
    ShapeFamily { name, symmetric: true, draw }
}

/// All families, in the order in which shapes are dealt out.
pub static FAMILIES: &[ShapeFamily] = &[
    family("chair", seating::chair),
    family("airplane", vehicles::airplane),
    family("mug", vessels::mug),
    family("house", buildings::house),
    family("hammer", tools::hammer),
    family("quadruped", animals::quadruped),
    family("table", furniture::table),
    family("car", vehicles::car),
    family("desk_lamp", lamps::desk_lamp),
    family("laptop", appliances::laptop),
    family("assembly", abstracts::assembly),
    family("sofa", seating::sofa),
    family("guitar", tools::guitar),
    family("teapot", vessels::teapot),
    family("person", animals::person),
    family("stairs", buildings::stairs),
    family("desk", furniture::desk),
    family("boat", vehicles::boat),
    family("plant", nature::plant),
    family("monitor", appliances::monitor),
    family("creature", abstracts::creature),
    family("bed", furniture::bed),
    family("bicycle", vehicles::bicycle),
    family("toilet", appliances::toilet),
    family("church", buildings::church),
    family("drill", tools::drill),
    family("bird", animals::bird),
    family("bookshelf", furniture::bookshelf),
    family("truck", vehicles::truck),
    symmetric("bottle", vessels::bottle),
    family("piano", appliances::piano),
    family("framework", abstracts::framework),
    family("office_chair", seating::office_chair),
    family("bathtub", vessels::bathtub),
    family("helicopter", vehicles::helicopter),
    family("floor_lamp", lamps::floor_lamp),
    family("wrench", tools::wrench),
    family("fireplace", buildings::fireplace),
    family("fish", animals::fish),
    family("cabinet", furniture::cabinet),
    family("radio", appliances::radio),
    family("jug", vessels::jug),
    family("bench", seating::bench),
    family("castle", buildings::castle),
    family("saw", tools::saw),
    family("tree", nature::tree),
    symmetric("vase", vessels::vase),
    family("sink", vessels::sink),
    family("range_hood", appliances::range_hood),
    family("stool", seating::stool),
    family("faucet", tools::faucet),
    family("gamepad", appliances::gamepad),
    family("ridge_tent", buildings::ridge_tent),
    family("watering_can", vessels::watering_can),
    symmetric("bowl", vessels::bowl),
    family("keyboard", appliances::keyboard),
];
