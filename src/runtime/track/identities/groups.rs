//! Dots that hang together.

use crate::track::model::DotModel;

/// Finds the groups of dots that hang together over the pattern's neighbours; keeps its buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct Groups {
    /// The group of each dot, from 1; 0 of what is in none.
    of: Vec<u32>,
    stack: Vec<usize>,
    largest: u32,
}

impl Groups {
    /// Buffers for so many dots.
    pub fn new(dots: usize) -> Self {
        Self { of: Vec::with_capacity(dots), stack: Vec::with_capacity(dots), largest: 0 }
    }

    /// Groups the dots that are in place; neighbours of which `is_alike` holds are in one group.
    pub fn find(
        &mut self,
        models: &[DotModel],
        is_in_place: impl Fn(usize) -> bool,
        is_alike: impl Fn(usize, usize) -> bool,
    ) {
        self.of.clear();
        self.of.resize(models.len(), 0);
        let (mut last, mut largest_size) = (0, 0);
        self.largest = 0;
        for start in 0..models.len() {
            if self.of[start] != 0 || !is_in_place(start) {
                continue;
            }
            last += 1;
            let mut size = 0;
            self.of[start] = last;
            self.stack.push(start);
            while let Some(index) = self.stack.pop() {
                size += 1;
                for other in &models[index].neighbors {
                    if self.of[*other] == 0 && is_in_place(*other) && is_alike(index, *other) {
                        self.of[*other] = last;
                        self.stack.push(*other);
                    }
                }
            }
            if size > largest_size {
                (self.largest, largest_size) = (last, size);
            }
        }
    }

    /// Whether a dot is in the largest group.
    pub fn is_in_largest(&self, index: usize) -> bool {
        self.largest != 0 && self.of.get(index) == Some(&self.largest)
    }
}
