//! A bounded number of things, evenly spaced, of a stream whose length nobody knows.

/// Keeps every n-th thing; n doubles whenever there are too many.
#[derive(Debug, Clone)]
pub struct Thinned<T> {
    kept: Vec<T>,
    max_kept: usize,
    stride: u64,
    seen: u64,
}

impl<T> Thinned<T> {
    /// Keeps at most so many, at least one.
    pub fn new(max_kept: usize) -> Self {
        Self { kept: Vec::new(), max_kept: max_kept.max(1), stride: 1, seen: 0 }
    }

    /// Offers the next thing, which is made only where it is kept.
    pub fn offer(&mut self, make: impl FnOnce() -> T) {
        if self.seen.is_multiple_of(self.stride) && self.kept.len() >= self.max_kept {
            let mut is_even = false;
            self.kept.retain(|_| {
                is_even = !is_even;
                is_even
            });
            self.stride *= 2;
        }
        if self.seen.is_multiple_of(self.stride) {
            self.kept.push(make());
        }
        self.seen += 1;
    }

    /// What is kept, in order.
    pub fn kept(&self) -> &[T] {
        &self.kept
    }

    /// Every so many-th was kept.
    pub fn stride(&self) -> u64 {
        self.stride
    }

    /// How many were offered.
    pub fn seen(&self) -> u64 {
        self.seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_evenly_spaced_and_bounded() {
        for (max_kept, count) in [(60, 1), (60, 60), (60, 61), (60, 1000), (1, 9), (3, 100)] {
            let mut thinned = Thinned::new(max_kept);
            (0..count).for_each(|n| thinned.offer(|| n));
            let kept = thinned.kept();
            assert!(
                kept.len() <= max_kept && (2 * kept.len() >= max_kept || kept.len() as u64 == count),
                "{kept:?}"
            );
            assert!(kept.iter().enumerate().all(|(i, n)| *n == i as u64 * thinned.stride()), "{kept:?}");
            assert!(count - kept.last().unwrap() <= thinned.stride(), "{kept:?}");
        }
    }
}
