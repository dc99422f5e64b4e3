//! Which sensors and which loads are of which split.

use crate::spec::Split;

/// The split of a slice of the loads.
pub fn split_of_slice(slice: u32) -> Split {
    match slice {
        slice if slice % 4 == 2 => Split::Test,
        slice if slice % 8 == 4 => Split::Val,
        _ => Split::Train,
    }
}

/// The splits' sensors, spread evenly over all: the split that lies furthest behind its share gets the next one.
pub(crate) fn spread(counts: [u32; 3]) -> Vec<Split> {
    let counts = counts.map(i64::from);
    let all: i64 = counts.iter().sum();
    let mut given = [0_i64; 3];
    let mut next = |number: i64| {
        let behind = |k: &usize| ((number + 1) * counts[*k] - given[*k] * all, 3 - *k);
        let k = (0..3).filter(|k| given[*k] < counts[*k]).max_by_key(behind).unwrap_or(0);
        given[k] += 1;
        Split::ALL[k]
    };
    (0..all).map(&mut next).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splits_are_spread_and_loads_are_shared_out() {
        let splits = spread([14, 2, 6]);
        let count = |split| splits.iter().filter(|s| **s == split).count();
        assert_eq!([14, 2, 6], [Split::Train, Split::Val, Split::Test].map(count));
        assert!(splits.iter().take(6).any(|s| *s == Split::Test), "{splits:?}");
        assert_eq!(spread([0, 0, 3]), [Split::Test; 3]);
        let slices: Vec<Split> = (0..8).map(split_of_slice).collect();
        assert!(Split::ALL.iter().all(|split| slices.contains(split)));
    }
}
