//! Results as records of one size, for loops that have no time to read text.

use std::io::{self, Write};

use glam::DVec3;

use super::result::Tracked;
use crate::track::marks::MarkState;
use domecast_springs::{Displacement, Wrench};

/// Bytes of a frame's record: thirty little-endian numbers of eight bytes.
pub const RECORD_BYTES: usize = 240;

/// The frame's record: `frame` (u64), `time_s`, `problems` (u64: bit `i` is [`Problem::ALL`](super::Problem::ALL)'s `i`, none is
/// `ok`), `dots_ok` (u64), then f64: displacement of the platform's point at `at_mm` (mm, rad), its deviations, wrench (N, N mm),
/// its deviations (six each), `pose_rms_px`, and one that is NaN for what may come. NaN is what is not known.
///
/// # Errors
/// Those of the writer.
pub fn write_record(out: &mut impl Write, tracked: &Tracked, at_mm: DVec3) -> io::Result<()> {
    const UNKNOWN: [f64; 6] = [f64::NAN; 6];
    let problems = tracked.problems.iter().fold(0_u64, |bits, problem| bits | 1 << problem as u64);
    out.write_all(&tracked.frame.to_le_bytes())?;
    out.write_all(&tracked.time_s.unwrap_or(f64::NAN).to_le_bytes())?;
    out.write_all(&problems.to_le_bytes())?;
    out.write_all(&(tracked.count(MarkState::Ok) as u64).to_le_bytes())?;
    let sixes = [
        tracked.pose.map(|pose| Displacement::of_pose(&pose, at_mm).to_array()),
        tracked.pose_sd.map(Displacement::to_array),
        tracked.wrench.map(Wrench::to_array),
        tracked.wrench_sd.map(Wrench::to_array),
    ];
    let numbers = sixes.into_iter().flat_map(|six| six.unwrap_or(UNKNOWN));
    let last = [tracked.pose_rms_px.unwrap_or(f64::NAN), f64::NAN];
    for number in numbers.chain(last) {
        out.write_all(&number.to_le_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_has_its_size_and_nan_for_what_is_not_known() {
        let mut record = Vec::new();
        let tracked = Tracked { frame: 7, ..Tracked::default() };
        write_record(&mut record, &tracked, DVec3::ZERO).unwrap();
        assert_eq!(record.len(), RECORD_BYTES);
        let word = |i: usize| <[u8; 8]>::try_from(&record[8 * i..8 * i + 8]).unwrap();
        assert_eq!([0, 2, 3].map(|i| u64::from_le_bytes(word(i))), [7, 0, 0]);
        assert!([1].into_iter().chain(4..30).all(|i| f64::from_le_bytes(word(i)).is_nan()));
    }
}
