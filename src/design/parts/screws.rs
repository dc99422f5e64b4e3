//! Screws as they are sold: what follows from the diameter of a hole.

/// A metric thread. Tapping drills after ISO 2306, clearance holes (fine) after ISO 273, cap heads after ISO 4762,
/// lengths of set screws after ISO 4026.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Thread {
    /// "M2".
    pub name: &'static str,
    /// Outer diameter, mm.
    pub nominal_mm: f64,
    /// Diameter of the hole that is tapped, mm.
    pub tap_mm: f64,
    /// Diameter of a fine clearance hole, mm.
    pub clearance_mm: f64,
    /// Diameter of a cap head, mm; it is as high as the thread is wide.
    pub head_mm: f64,
    /// Lengths of set screws, mm.
    pub set_mm: &'static [f64],
}

const fn thread(
    name: &'static str,
    [nominal_mm, tap_mm, clearance_mm, head_mm]: [f64; 4],
    set_mm: &'static [f64],
) -> Thread {
    Thread { name, nominal_mm, tap_mm, clearance_mm, head_mm, set_mm }
}

/// The threads, the smallest first.
pub(super) const THREADS: [Thread; 9] = [
    thread("M1.6", [1.6, 1.25, 1.7, 3.0], &[2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0]),
    thread("M2", [2.0, 1.6, 2.2, 3.8], &[2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0]),
    thread("M2.5", [2.5, 2.05, 2.7, 4.5], &[2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0]),
    thread("M3", [3.0, 2.5, 3.2, 5.5], &[3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0]),
    thread("M4", [4.0, 3.3, 4.3, 7.0], &[4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0]),
    thread("M5", [5.0, 4.2, 5.3, 8.5], &[5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 25.0]),
    thread("M6", [6.0, 5.0, 6.4, 10.0], &[6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 30.0]),
    thread("M8", [8.0, 6.8, 8.4, 13.0], &[8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 30.0, 40.0]),
    thread("M10", [10.0, 8.5, 10.5, 16.0], &[10.0, 12.0, 16.0, 20.0, 25.0, 30.0, 40.0, 50.0]),
];

/// A printed hole is that much too small or too large for a thread, and serves it all the same, mm.
const SLACK_MM: f64 = 0.05;

impl Thread {
    /// The largest thread that is tapped into a hole.
    pub(super) fn tapped_into(hole_mm: f64) -> Option<Self> {
        THREADS.into_iter().rev().find(|t| t.tap_mm <= hole_mm + SLACK_MM)
    }

    /// The largest thread that passes a hole.
    pub(super) fn through(hole_mm: f64) -> Option<Self> {
        THREADS.into_iter().rev().find(|t| t.clearance_mm <= hole_mm + SLACK_MM)
    }

    /// The longest set screw that a length holds.
    pub(super) fn set_screw_within(&self, length_mm: f64) -> Option<f64> {
        self.set_mm.iter().rev().copied().find(|&l| l <= length_mm)
    }

    /// The longest set screw of all.
    pub(super) fn longest_mm(&self) -> f64 {
        self.set_mm.last().copied().unwrap_or(0.0)
    }
}
