//! What is done with each frame, and what is said of the device.

use std::collections::BTreeMap;
use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant, SystemTime};

use serde_json::{Value, json};

use super::arguments::LiveArguments;
use super::described::{described, head};
use super::health::Health;
use super::terminal::{TerminalView, ViewedReading};
use crate::commands::hardness_lines::{HardnessLines, in_words};
use crate::commands::input::input_fault;
use crate::commands::output::{Failure, Output};
use crate::commands::recording::{Recording, recorded};
use crate::commands::track::add_member;
use domecast_live::decode::Picture;
use domecast_live::page::LivePage;
use domecast_live::source::{ArrivedFrame, SourceInfo};
use domecast_live::{AgeStatistics, HeightReader, LiveReading};
use domecast_runtime::track::{CameraFrame, Tracked, Tracker, write_json_fields};
use std::sync::Arc;

/// How fast the shown rate follows.
const FOLLOW: f64 = 0.05;

/// Where readings go beside standard output.
pub struct Outlets {
    pub page: Option<LivePage>,
    pub recording: Option<Recording>,
    /// What measures the skin for both.
    pub heights: Option<HeightReader>,
    pub hardness: Option<HardnessLines>,
}

/// A run of `live`.
pub struct Session<'a> {
    output: &'a Output,
    arguments: &'a LiveArguments,
    tracker: Tracker,
    page: Option<LivePage>,
    recording: Option<Recording>,
    heights: Option<HeightReader>,
    hardness: Option<HardnessLines>,
    /// What the model last said.
    felt: Value,
    is_rest_touched: bool,
    is_recording_lost: bool,
    view: Option<TerminalView>,
    head: String,
    line: Vec<u8>,
    /// Nanoseconds since 1970 of the source's time 0.
    began_ns: u64,
    last: Option<Instant>,
    step_s: f64,
    device: &'static str,
    health: Health,
    ages: AgeStatistics,
    age_ms: f64,
    counts: BTreeMap<&'static str, u64>,
    dropped: u64,
    reconnects: u64,
}

impl<'a> Session<'a> {
    pub fn begin(
        output: &'a Output,
        arguments: &'a LiveArguments,
        tracker: Tracker,
        info: &SourceInfo,
        Outlets { page, recording, heights, hardness }: Outlets,
    ) -> Result<Self, Failure> {
        let is_seen = io::stdout().is_terminal() && !output.is_json();
        let began = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let url = page.as_ref().map(LivePage::url);
        let mut session = Self {
            output,
            arguments,
            tracker,
            page,
            recording,
            heights,
            hardness,
            felt: Value::Null,
            is_rest_touched: false,
            is_recording_lost: false,
            view: is_seen.then(TerminalView::default),
            head: head(info),
            line: Vec::new(),
            began_ns: u64::try_from(began.as_nanos()).unwrap_or(u64::MAX),
            last: None,
            step_s: 0.0,
            device: "ok",
            health: Health::default(),
            ages: AgeStatistics::default(),
            age_ms: 0.0,
            counts: BTreeMap::new(),
            dropped: 0,
            reconnects: 0,
        };
        let mut about = described(info);
        about["page"] = json!(url);
        session.event("started", about, None)?;
        if let Some(url) = url {
            output.note(&format!("the page is at {url}"));
        }
        for warning in &info.warnings {
            session.output.warn(warning);
        }
        Ok(session)
    }

    /// How many frames there were.
    pub fn frames(&self) -> u64 {
        self.counts.values().sum()
    }

    fn put_line(&mut self) -> Result<(), Failure> {
        let mut out = io::stdout().lock();
        Ok(out.write_all(&self.line).and_then(|()| out.flush())?)
    }

    /// Says what happened: a JSON line, or below the view.
    fn event(&mut self, name: &str, mut about: Value, message: Option<&str>) -> Result<(), Failure> {
        if let Some(view) = &mut self.view {
            view.leave();
        }
        if let Some(message) = message {
            self.output.warn(message);
            about["message"] = json!(message);
        }
        if self.view.is_none() {
            let mut line = json!({ "event": name });
            if let (Some(line), Value::Object(about)) = (line.as_object_mut(), about) {
                line.extend(about);
            }
            self.line.clear();
            writeln!(self.line, "{line}")?;
            self.put_line()?;
        }
        Ok(())
    }

    /// Reads a frame and gives its numbers out.
    pub fn frame(&mut self, frame: &ArrivedFrame, pushed_out: u64) -> Result<(), Failure> {
        self.dropped += pushed_out;
        let mut decoded = frame.data.decode();
        let is_mirrored = self.arguments.tracker.camera_mirrored;
        if let (true, Ok(picture)) = (is_mirrored, &mut decoded) {
            Arc::make_mut(picture).mirror();
        }
        self.tracker.stamp(frame.time_s);
        let seen = decoded.as_deref().map_err(Clone::clone).and_then(Picture::frame);
        let tracked = match &seen {
            Ok(seen) => self.tracker.track(frame.number, seen),
            Err(_) => self.tracker.skip(frame.number),
        };
        *self.counts.entry(tracked.status()).or_default() += 1;
        let felt =
            self.hardness.as_mut().and_then(|model| model.member(seen.as_ref().ok(), tracked, None, None));
        if self.view.is_none() {
            let age = frame.complete.elapsed();
            write_reading(&mut self.line, tracked, self.arguments, felt.as_ref(), age, self.dropped)?;
            let mut out = io::stdout().lock();
            out.write_all(&self.line).and_then(|()| out.flush())?;
        }
        self.felt = felt.unwrap_or(std::mem::take(&mut self.felt));
        let age = frame.complete.elapsed();
        // the numbers are out; what follows is of no reading's age but the next one's
        self.ages.add(age);
        self.age_ms = 1e3 * age.as_secs_f64();
        self.keep_pace(frame.complete);
        let file = frame.file.as_deref().filter(|_| !is_mirrored);
        self.record(frame.time_s, seen.as_ref().ok().copied(), file)?;
        self.look(frame.complete, decoded.ok())
    }

    /// The rate, from frame to frame.
    fn keep_pace(&mut self, now: Instant) {
        if let Some(last) = self.last.replace(now) {
            let step_s = now.saturating_duration_since(last).as_secs_f64();
            self.step_s =
                if self.step_s == 0.0 { step_s } else { self.step_s + FOLLOW * (step_s - self.step_s) };
        }
    }

    fn rate_hz(&self) -> f64 {
        if self.step_s > 0.0 { 1.0 / self.step_s } else { 0.0 }
    }

    fn record(
        &mut self,
        time_s: f64,
        seen: Option<CameraFrame<'_>>,
        file: Option<&[u8]>,
    ) -> Result<(), Failure> {
        let time_ns = self.time_ns(time_s);
        let Some(recording) = &mut self.recording else { return Ok(()) };
        let added = recording.add(time_ns, recorded(seen, file), self.tracker.result(), None);
        self.keep(added)
    }

    /// When a frame was taken, nanoseconds since 1970.
    fn time_ns(&self, time_s: f64) -> u64 {
        self.began_ns.saturating_add((1e9 * time_s).max(0.0) as u64)
    }

    /// Goes on without a recording that takes no more.
    fn keep(&mut self, added: Result<(), Failure>) -> Result<(), Failure> {
        if let Err(failure) = added {
            // reading goes on: a full disk must not stop a robot
            self.recording = None;
            self.is_recording_lost = true;
            let message = failure.message().unwrap_or_default();
            self.event("recording_lost", json!({}), Some(&message))?;
        }
        Ok(())
    }

    /// Shows the reading to people, and says what is wrong with all frames.
    fn look(&mut self, now: Instant, picture: Option<Arc<Picture>>) -> Result<(), Failure> {
        let found = self.health.watch(self.tracker.result(), now);
        let device = self.health.status().unwrap_or(self.device);
        if let Some(found) = found {
            let about = json!({ "status": found.status });
            self.event("no_measurement", about, Some(&found.message))?;
        }
        self.show(picture, device)?;
        let (rate_hz, hardness) = (self.rate_hz(), self.felt_in_words());
        let tracked = self.tracker.result();
        let Some(view) = &mut self.view else { return Ok(()) };
        let quantile = |share| self.ages.quantile_ms(share).unwrap_or(0.0);
        let around = ViewedReading {
            head: &self.head,
            device,
            rate_hz,
            age_ms: self.age_ms,
            age_p50_ms: quantile(0.5),
            age_p99_ms: quantile(0.99),
            dropped: self.dropped,
            hardness,
        };
        Ok(view.show(tracked, &around)?)
    }

    /// What the model last said; `None` without one.
    fn felt_in_words(&self) -> Option<String> {
        self.hardness.as_ref().map(|_| in_words(&self.felt))
    }

    /// To the page, and to what measures the skin: a frame whose skin is measured is shown and recorded with it, once it is.
    fn show(&mut self, picture: Option<Arc<Picture>>, device: &'static str) -> Result<(), Failure> {
        let page = self.page.as_ref().filter(|page| page.is_watched());
        if let Some(page) = page {
            page.add_sample(self.tracker.result());
        }
        let (age_ms, rate_hz, dropped) = (self.age_ms, self.rate_hz(), self.dropped);
        let hardness = self.felt_in_words();
        let tracked = self.tracker.result();
        let reading = || LiveReading {
            picture,
            tracked: tracked.clone(),
            skin: None,
            age_ms,
            rate_hz,
            dropped,
            device,
            hardness,
        };
        let Some(heights) = &mut self.heights else {
            if let Some(page) = page {
                page.show(reading());
            }
            return Ok(());
        };
        let measured = heights.take();
        if page.is_some() || self.recording.is_some() {
            heights.offer(reading);
        }
        measured.map_or(Ok(()), |measured| self.measured(measured))
    }

    /// A reading whose skin is measured.
    fn measured(&mut self, reading: LiveReading) -> Result<(), Failure> {
        let time_ns = self.time_ns(reading.tracked.time_s.unwrap_or(0.0));
        let added = match (&mut self.recording, &reading.skin) {
            (Some(recording), Some(skin)) => recording.add_height(time_ns, skin),
            _ => Ok(()),
        };
        self.keep(added)?;
        if let Some(skin) = &reading.skin {
            if let Some(model) = &mut self.hardness {
                model.see_skin(skin);
            }
            if skin.is_raised && !self.is_rest_touched {
                self.is_rest_touched = true;
                let message = "the skin lies above its shape at rest: --rest was touched when it was taken, or something pulls at the skin";
                self.event("raised", json!({}), Some(message))?;
            }
        }
        if let Some(page) = &self.page {
            page.show(reading);
        }
        Ok(())
    }

    pub fn unplugged(&mut self, why: &str) -> Result<(), Failure> {
        self.device = "unplugged";
        self.event("unplugged", json!({}), Some(&format!("{why}; waiting for it to come back")))
    }

    pub fn replugged(&mut self, after: Duration, info: &SourceInfo) -> Result<(), Failure> {
        self.device = "ok";
        self.reconnects += 1;
        // the steps across it are none
        self.last = None;
        self.head = head(info);
        let mut about = described(info);
        about["after_s"] = json!((1e3 * after.as_secs_f64()).round() / 1e3);
        self.event(
            "replugged",
            about,
            Some(&format!("the device is back after {:.1} s", after.as_secs_f64())),
        )
    }

    pub fn stalled(&mut self) -> Result<(), Failure> {
        if self.device != "ok" {
            return Ok(());
        }
        self.event("stalled", json!({}), Some("no frame came for a second"))
    }

    pub fn failed(&mut self, why: &str) -> Result<(), Failure> {
        self.event("failed", json!({}), Some(why))
    }

    /// The summary.
    pub fn end(mut self) -> Result<(), Failure> {
        if let Some(last) = self.heights.take().and_then(HeightReader::finish) {
            self.measured(last)?;
        }
        if let Some(recording) = self.recording.take() {
            recording.end()?;
        }
        let ms = |share| self.ages.quantile_ms(share).map(|ms| (1e3 * ms).round() / 1e3);
        let (p50, p99, max) = (ms(0.5), ms(0.99), ms(1.0));
        let frames = self.frames();
        let about = json!({
            "frames": frames, "dropped": self.dropped, "reconnects": self.reconnects, "status": self.counts,
            "age_p50_ms": p50, "age_p99_ms": p99, "age_max_ms": max,
        });
        let statuses: Vec<String> = self.counts.iter().map(|(status, n)| format!("{n} {status}")).collect();
        let (dropped, reconnects) = (self.dropped, self.reconnects);
        self.event("ended", about, None)?;
        if frames == 0 {
            let device = std::path::Path::new(&self.arguments.device);
            return Err(input_fault(device, "gave no frame", "a device that gives frames"));
        }
        if self.view.is_some() {
            let age = |ms: Option<f64>| ms.unwrap_or(0.0);
            self.output.say(&format!(
                "{frames} frames ({}), {dropped} dropped, {reconnects} reconnects; age of a reading: half to {:.2} ms, 99 of 100 to \
                 {:.2} ms, at most {:.2} ms",
                statuses.join(", "),
                age(p50),
                age(p99),
                age(max),
            ))?;
        }
        if self.is_recording_lost { Err(Failure::Negative) } else { Ok(()) }
    }
}

/// A reading's line: that of `track`, with its age and how many frames were pushed out so far.
fn write_reading(
    line: &mut Vec<u8>,
    tracked: &Tracked,
    arguments: &LiveArguments,
    felt: Option<&Value>,
    age: Duration,
    dropped: u64,
) -> io::Result<()> {
    line.clear();
    write_json_fields(line, tracked, &arguments.fields)?;
    if let Some(felt) = felt {
        add_member(line, "hardness", felt);
    }
    if line.ends_with(b"}\n") {
        line.truncate(line.len() - 2);
    }
    writeln!(line, ",\"age_ms\":{:.3},\"dropped\":{dropped}}}", 1e3 * age.as_secs_f64())
}
