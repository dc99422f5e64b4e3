//! How recorded frames are played, and which faults of cameras are played with them.

use std::path::PathBuf;

/// Settings of a [`Player`](super::Player). Shares are probabilities for each frame.
#[derive(Debug, Clone, PartialEq)]
pub struct PlayerOptions {
    /// Frames a second.
    pub rate_hz: f64,
    /// How many frames are played, back and forth through the folder; `None`: once through it.
    pub frames: Option<u64>,
    /// Share of frames that never come.
    pub drop: f64,
    /// Share of frames that show the last one again.
    pub repeat: f64,
    /// Share of frames whose upper rows are of the last one.
    pub tear: f64,
    /// Share of frames that come late.
    pub delay: f64,
    /// How late, ms.
    pub delay_ms: f64,
    /// Frames from which on the device is gone for a while.
    pub unplug: Vec<u64>,
    /// For how long, s.
    pub unplug_s: f64,
    /// Of the random numbers.
    pub seed: u64,
}

impl Default for PlayerOptions {
    fn default() -> Self {
        Self {
            rate_hz: 30.0,
            frames: None,
            drop: 0.0,
            repeat: 0.0,
            tear: 0.0,
            delay: 0.0,
            delay_ms: 10.0,
            unplug: Vec::new(),
            unplug_s: 0.5,
            seed: 1,
        }
    }
}

const NAMES: &str = "rate, frames, drop, repeat, tear, delay, delay_ms, unplug, unplug_s, seed";

impl PlayerOptions {
    /// Reads `FOLDER?name=value&..`.
    ///
    /// # Errors
    /// Which setting is wrong and what may stand there.
    pub fn parse(text: &str) -> Result<(PathBuf, Self), String> {
        let (folder, settings) = text.split_once('?').unwrap_or((text, ""));
        if folder.is_empty() {
            return Err("names no folder of frames: player:FOLDER?rate=60".into());
        }
        let mut options = Self::default();
        for setting in settings.split('&').filter(|setting| !setting.is_empty()) {
            let (name, value) = setting.split_once('=').unwrap_or((setting, ""));
            options.set(name, value)?;
        }
        Ok((folder.into(), options))
    }

    fn set(&mut self, name: &str, value: &str) -> Result<(), String> {
        let number = |low: f64, high: f64| {
            let number = value.parse().ok().filter(|v: &f64| (low..=high).contains(v));
            number.ok_or_else(|| format!("{name}={value}: a number from {low} to {high} may stand here"))
        };
        let count = |text: &str| {
            text.parse::<u64>().map_err(|_| format!("{name}={value}: whole numbers may stand here"))
        };
        match name {
            "rate" => self.rate_hz = number(0.1, 1000.0)?,
            "frames" => self.frames = Some(count(value)?),
            "drop" => self.drop = number(0.0, 1.0)?,
            "repeat" => self.repeat = number(0.0, 1.0)?,
            "tear" => self.tear = number(0.0, 1.0)?,
            "delay" => self.delay = number(0.0, 1.0)?,
            "delay_ms" => self.delay_ms = number(0.0, 10_000.0)?,
            "unplug" => self.unplug = value.split(',').map(count).collect::<Result<_, _>>()?,
            "unplug_s" => self.unplug_s = number(0.0, 3600.0)?,
            "seed" => self.seed = count(value)?,
            _ => return Err(format!("{name}: is no setting of the player; there are {NAMES}")),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_read_and_wrong_ones_named() {
        let (folder, options) =
            PlayerOptions::parse("a/b?rate=60&frames=9&tear=0.5&unplug=3,7&seed=4").unwrap();
        assert_eq!((folder, options.frames, options.unplug), (PathBuf::from("a/b"), Some(9), vec![3, 7]));
        for (wrong, named) in [
            ("", "folder"),
            ("a?rate=0", "rate=0"),
            ("a?rate=nan", "rate=nan"),
            ("a?drop=2", "drop=2"),
            ("a?loop=1", "loop"),
            ("a?unplug=x", "unplug=x"),
        ] {
            let problem = PlayerOptions::parse(wrong).unwrap_err();
            assert!(problem.contains(named), "{wrong}: {problem}");
        }
    }
}
