//! Which points of a large cloud are drawn.

/// Indices of `budget` of `n` points, ascending; all of them if they are no more than the budget.
///
/// The list is cut into `budget` runs of equal length and one point is drawn from each, by a hash
/// of the run's number. So every part of the file and every density keeps its share, and scans that
/// are stored line by line show no moiré as they would with a fixed stride. No seed: the same cloud
/// always shows the same points.
pub(crate) fn even_indices(n: usize, budget: usize) -> Vec<usize> {
    if n <= budget {
        return (0..n).collect();
    }
    // In u128, since n * budget may not fit.
    let start = |run: usize| (run as u128 * n as u128 / budget as u128) as usize;
    (0..budget)
        .map(|run| {
            let (first, end) = (start(run), start(run + 1));
            first + (hash(run as u64) % (end - first) as u64) as usize
        })
        .collect()
}

/// SplitMix64's output function (Steele, Lea and Flood 2014).
fn hash(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_clouds_are_kept_whole() {
        assert_eq!(even_indices(5, 7), [0, 1, 2, 3, 4]);
        assert_eq!(even_indices(7, 7).len(), 7);
        assert!(even_indices(0, 7).is_empty());
        assert!(even_indices(9, 0).is_empty());
    }

    #[test]
    fn one_point_from_each_run() {
        for (n, budget) in [(8, 7), (1000, 33), (2_000_000, 120_000)] {
            let indices = even_indices(n, budget);
            assert_eq!(indices.len(), budget);
            assert!(indices.windows(2).all(|w| w[0] < w[1]));
            for (run, &index) in indices.iter().enumerate() {
                assert!(run * n / budget <= index && index < (run + 1) * n / budget);
            }
        }
        // Not a fixed stride.
        let indices = even_indices(1000, 100);
        assert!(indices.windows(2).any(|w| w[1] - w[0] != 10));
    }
}
