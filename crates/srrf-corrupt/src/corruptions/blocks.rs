//! Points in blocks, coordinate by coordinate, so that one instruction does several of them.

use pulp::{Arch, NullaryFnOnce};

/// Points of a block.
pub(super) const LANES: usize = 8;

/// One number for each point of a block.
pub(super) type Lane = [f64; LANES];

/// A motion of points that depends on nothing but the point.
pub(super) trait BlockMotion {
    /// The coordinates x, y, z of a block, moved. Each point must go through the same roundings as it would alone.
    fn apply(&self, block: &[Lane; 3]) -> [Lane; 3];
}

/// Moves all points, with the widest vectors of the processor. Wide or not, the bits are the same.
pub(super) fn move_all(points: &[[f64; 3]], motion: &impl BlockMotion) -> Vec<[f64; 3]> {
    Arch::new().dispatch(MoveAll { points, motion })
}

/// A closure would not do: what is not inlined is compiled for the narrowest vectors.
struct MoveAll<'a, M> {
    points: &'a [[f64; 3]],
    motion: &'a M,
}

impl<M: BlockMotion> NullaryFnOnce for MoveAll<'_, M> {
    type Output = Vec<[f64; 3]>;

    #[inline(always)]
    fn call(self) -> Vec<[f64; 3]> {
        let mut moved = Vec::with_capacity(self.points.len());
        for some in self.points.chunks(LANES) {
            let mut block = [[0.0; LANES]; 3];
            for (lane, point) in some.iter().enumerate() {
                (0..3).for_each(|c| block[c][lane] = point[c]);
            }
            let [x, y, z] = self.motion.apply(&block);
            moved.extend((0..some.len()).map(|lane| [x[lane], y[lane], z[lane]]));
        }
        moved
    }
}
