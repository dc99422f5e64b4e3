//! Exposure, gain and white balance, locked and read back: thresholds and shape from colour rest on light that stays.

use std::fmt;

/// A control of a camera, by what it is called in Video4Linux.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ControlId {
    /// `exposure_auto`, a menu: 1 is manual.
    ExposureAuto,
    /// `exposure_absolute`, 0.1 ms.
    Exposure,
    /// `exposure_auto_priority`: whether the rate may fall for a longer exposure.
    ExposurePriority,
    /// `autogain`.
    GainAuto,
    /// `gain`, in the camera's own steps.
    Gain,
    /// `white_balance_automatic`.
    WhiteBalanceAuto,
    /// `white_balance_temperature`, K.
    WhiteBalance,
    /// `focus_automatic_continuous`.
    FocusAuto,
}

/// What a control takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ControlRange {
    /// Smallest value.
    pub min: i32,
    /// Largest value.
    pub max: i32,
    /// From value to value.
    pub step: i32,
}

impl fmt::Display for ControlRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {} in steps of {}", self.min, self.max, self.step.max(1))
    }
}

/// A control as it was read back.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ControlReading {
    /// Its name, as in messages.
    pub name: &'static str,
    /// Its value, in the camera's units.
    pub value: i32,
}

/// The controls of a camera.
pub trait CameraControls {
    /// What a control takes; `None` where the camera does not have it.
    fn range(&self, id: ControlId) -> Option<ControlRange>;

    /// Its value.
    ///
    /// # Errors
    /// What the camera says.
    fn value(&self, id: ControlId) -> Result<i32, String>;

    /// Sets it.
    ///
    /// # Errors
    /// What the camera says.
    fn set(&mut self, id: ControlId, value: i32) -> Result<(), String>;
}

/// What the user wants; what is left open is locked where it stands.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ControlRequest {
    /// Exposure time, ms.
    pub exposure_ms: Option<f64>,
    /// Gain, in the camera's steps.
    pub gain: Option<i32>,
    /// Colour temperature, K.
    pub white_balance_k: Option<i32>,
}

/// A control of light with its automatic.
struct Locked {
    name: &'static str,
    option: &'static str,
    automatic: ControlId,
    /// The automatic's value that is off.
    off: i32,
    manual: ControlId,
    wanted: Option<i32>,
}

/// Switches automatics off, sets what is wanted, and reads all of it back. Returns what was read, and a warning for each
/// control that the camera does not have.
///
/// # Errors
/// An automatic that cannot be switched off; a value that is wanted and not taken: what may stand there.
pub fn lock_controls(
    camera: &mut dyn CameraControls,
    request: &ControlRequest,
) -> Result<(Vec<ControlReading>, Vec<String>), String> {
    let exposure = request.exposure_ms.map(|ms| (10.0 * ms).round() as i32);
    let all = [
        Locked {
            name: "exposure",
            option: "--exposure",
            automatic: ControlId::ExposureAuto,
            off: 1,
            manual: ControlId::Exposure,
            wanted: exposure,
        },
        Locked {
            name: "gain",
            option: "--gain",
            automatic: ControlId::GainAuto,
            off: 0,
            manual: ControlId::Gain,
            wanted: request.gain,
        },
        Locked {
            name: "white balance",
            option: "--white-balance",
            automatic: ControlId::WhiteBalanceAuto,
            off: 0,
            manual: ControlId::WhiteBalance,
            wanted: request.white_balance_k,
        },
    ];
    let (mut readings, mut warnings) = (Vec::new(), Vec::new());
    for one in all {
        lock(camera, &one, &mut readings, &mut warnings)?;
    }
    // not light, but pictures change with them too
    for (name, id) in
        [("exposure priority", ControlId::ExposurePriority), ("autofocus", ControlId::FocusAuto)]
    {
        if camera.range(id).is_some() {
            switch_off(camera, name, id, 0)?;
        }
    }
    Ok((readings, warnings))
}

fn switch_off(camera: &mut dyn CameraControls, name: &str, id: ControlId, off: i32) -> Result<(), String> {
    if camera.value(id) == Ok(off) {
        return Ok(());
    }
    let set = camera.set(id, off);
    match (set, camera.value(id)) {
        (_, Ok(value)) if value == off => Ok(()),
        (Err(problem), _) | (Ok(()), Err(problem)) => {
            Err(format!("the automatic {name} cannot be switched off ({problem})"))
        }
        (Ok(()), Ok(value)) => {
            Err(format!("the automatic {name} cannot be switched off: it stays at {value}"))
        }
    }
}

fn lock(
    camera: &mut dyn CameraControls,
    one: &Locked,
    readings: &mut Vec<ControlReading>,
    warnings: &mut Vec<String>,
) -> Result<(), String> {
    let Locked { name, option, automatic, off, manual, wanted } = *one;
    let has_automatic = camera.range(automatic).is_some();
    if has_automatic {
        switch_off(camera, name, automatic, off)?;
    }
    let Some(range) = camera.range(manual) else {
        if wanted.is_some() {
            return Err(format!("{option}: the camera has no control of its {name}"));
        }
        warnings.push(if has_automatic {
            format!("the camera does not tell its {name}: its automatic is off, the value is unknown")
        } else {
            format!("the camera has no control of its {name}: it may change by itself")
        });
        return Ok(());
    };
    if let Some(wanted) = wanted {
        let refused = |problem: String| {
            format!("{option}: the camera does not take {wanted} ({problem}); it takes {range}")
        };
        if !(range.min..=range.max).contains(&wanted) {
            return Err(refused("out of its range".into()));
        }
        camera.set(manual, wanted).map_err(refused)?;
        let value = camera.value(manual).map_err(refused)?;
        if value != wanted {
            return Err(refused(format!("it reads {value} afterwards")));
        }
    }
    let value = camera.value(manual).map_err(|problem| format!("its {name} cannot be read ({problem})"))?;
    readings.push(ControlReading { name, value });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// A camera with these controls: range, value, and whether it takes what is set.
    #[derive(Default)]
    struct Fake(BTreeMap<ControlId, (ControlRange, i32, bool)>);

    impl Fake {
        fn with(mut self, id: ControlId, [min, max, step, value]: [i32; 4], takes: bool) -> Self {
            self.0.insert(id, (ControlRange { min, max, step }, value, takes));
            self
        }
    }

    impl CameraControls for Fake {
        fn range(&self, id: ControlId) -> Option<ControlRange> {
            self.0.get(&id).map(|one| one.0)
        }

        fn value(&self, id: ControlId) -> Result<i32, String> {
            self.0.get(&id).map(|one| one.1).ok_or_else(|| "no such control".into())
        }

        fn set(&mut self, id: ControlId, value: i32) -> Result<(), String> {
            let one = self.0.get_mut(&id).ok_or("no such control")?;
            if one.2 {
                one.1 = one.0.min + (value - one.0.min) / one.0.step * one.0.step;
            }
            Ok(())
        }
    }

    fn webcam(takes: bool) -> Fake {
        Fake::default()
            .with(ControlId::ExposureAuto, [0, 3, 1, 3], takes)
            .with(ControlId::Exposure, [3, 2047, 1, 250], true)
            .with(ControlId::Gain, [0, 100, 10, 20], true)
            .with(ControlId::WhiteBalanceAuto, [0, 1, 1, 1], true)
            .with(ControlId::WhiteBalance, [2800, 6500, 100, 4600], true)
            .with(ControlId::FocusAuto, [0, 1, 1, 1], true)
    }

    #[test]
    fn automatics_are_off_and_values_are_read_back() {
        let mut camera = webcam(true);
        let request = ControlRequest {
            exposure_ms: Some(10.0),
            white_balance_k: Some(4000),
            ..ControlRequest::default()
        };
        let (readings, warnings) = lock_controls(&mut camera, &request).unwrap();
        let values: Vec<_> = readings.iter().map(|r| (r.name, r.value)).collect();
        assert_eq!(values, [("exposure", 100), ("gain", 20), ("white balance", 4000)]);
        assert!(warnings.is_empty());
        for (id, off) in
            [(ControlId::ExposureAuto, 1), (ControlId::WhiteBalanceAuto, 0), (ControlId::FocusAuto, 0)]
        {
            assert_eq!(camera.value(id), Ok(off));
        }
    }

    #[test]
    fn what_a_camera_does_not_take_is_refused_with_what_it_takes() {
        let problem = lock_controls(&mut webcam(false), &ControlRequest::default()).unwrap_err();
        assert!(problem.contains("automatic exposure cannot be switched off"), "{problem}");
        for (request, named) in [
            (ControlRequest { gain: Some(25), ..Default::default() }, "0 to 100 in steps of 10"),
            (ControlRequest { gain: Some(101), ..Default::default() }, "--gain"),
            (ControlRequest { exposure_ms: Some(1e9), ..Default::default() }, "3 to 2047"),
        ] {
            let problem = lock_controls(&mut webcam(true), &request).unwrap_err();
            assert!(problem.contains(named), "{problem}");
        }
        let mut bare = Fake::default();
        let (readings, warnings) = lock_controls(&mut bare, &ControlRequest::default()).unwrap();
        assert!(readings.is_empty() && warnings.len() == 3, "{warnings:?}");
        let problem =
            lock_controls(&mut bare, &ControlRequest { gain: Some(1), ..Default::default() }).unwrap_err();
        assert!(problem.contains("no control of its gain"), "{problem}");
    }
}
