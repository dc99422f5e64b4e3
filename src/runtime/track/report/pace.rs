//! Whether frames are missing, by their times.

/// A step of time over the usual one from which on frames are missing: one that is left out makes two, jitter less.
const MIN_LATE: f64 = 1.6;
/// Beside a single step, which jitters as much.
const MIN_LATE_AT_FIRST: f64 = 1.8;
/// How fast the usual step follows.
const FOLLOW: f64 = 0.1;

/// The usual step from frame to frame.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pace {
    last_s: Option<f64>,
    step_s: Option<f64>,
    /// Of one step.
    is_first: bool,
}

impl Pace {
    /// Whether a frame is later than the usual step after the last one, or not later at all.
    pub fn is_late(&mut self, time_s: Option<f64>) -> bool {
        let Some(now_s) = time_s.filter(|time_s| time_s.is_finite()) else {
            self.last_s = None;
            return false;
        };
        let Some(last_s) = self.last_s.replace(now_s) else { return false };
        let step_s = now_s - last_s;
        if step_s <= 0.0 {
            return true;
        }
        let Some(usual_s) = self.step_s else {
            self.step_s = Some(step_s);
            self.is_first = true;
            return false;
        };
        if std::mem::take(&mut self.is_first)
            && step_s < MIN_LATE_AT_FIRST * usual_s
            && usual_s < MIN_LATE_AT_FIRST * step_s
        {
            // Stamps that jitter back and forth make one step short and the next one long.
            self.step_s = Some(0.5 * (usual_s + step_s));
            return false;
        }
        let is_late = step_s > MIN_LATE * usual_s;
        self.step_s = if usual_s > MIN_LATE * step_s {
            // The first step was a gap itself.
            Some(step_s)
        } else {
            Some(usual_s + FOLLOW * (step_s.min(MIN_LATE * usual_s) - usual_s))
        };
        is_late
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_of_two_frames_is_a_gap_and_jitter_is_none() {
        let mut pace = Pace::default();
        let late: Vec<bool> =
            [0.0, 0.1, 0.2, 0.33, 0.4, 0.6, 0.7, 0.65, 0.75].iter().map(|t| pace.is_late(Some(*t))).collect();
        assert_eq!(late, [false, false, false, false, false, true, false, true, false]);
        // Where the first step is a gap, the second tells.
        let mut pace = Pace::default();
        let late: Vec<bool> = [0.0, 0.5, 0.6, 0.7, 0.9].iter().map(|t| pace.is_late(Some(*t))).collect();
        assert_eq!(late, [false, false, false, false, true]);
        // Stamps that jitter back and forth by 4 ms, and a frame that is missing right at first.
        let mut pace = Pace::default();
        let stamps = (0..30).map(|k| f64::from(k) / 30.0 + if k % 2 == 0 { 0.004 } else { -0.004 });
        assert_eq!(stamps.filter(|t| pace.is_late(Some(*t))).count(), 0);
        let mut pace = Pace::default();
        let late: Vec<bool> = [0.0, 0.1, 0.3, 0.4].iter().map(|t| pace.is_late(Some(*t))).collect();
        assert_eq!(late, [false, false, true, false]);
        // A rate that falls for good is the usual one in the end.
        let mut time_s = 0.4;
        let late = (0..60).filter(|_| {
            time_s += 0.2;
            pace.is_late(Some(time_s))
        });
        assert!(late.count() < 12);
        assert!(!pace.is_late(None) && !pace.is_late(Some(f64::NAN)) && !pace.is_late(Some(99.0)));
    }
}
