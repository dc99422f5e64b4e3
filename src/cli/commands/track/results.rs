//! Everything that `track` writes, frame by frame.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde_json::Value;

use super::arguments::{Format, TrackArguments};
use super::contact_hardness::ContactHardnessLines;
use super::pictures::Pictures;
use super::shape::ShapeFiles;
use crate::commands::hardness_lines::HardnessLines;
use crate::commands::output::{Failure, Output};
use crate::commands::recording::{Recording, RecordingPace, recorded, time_ns};
use crate::commands::rest_frame::RestFrame;
use crate::track_report::{TrackReport, page};
use domecast_files::{OutputRules, StagedFile};
use domecast_runtime::constants::Constants;
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::{
    CSV_HEADER, CameraFrame, DOTS_CSV_HEADER, Springs, Tracked, Tracker, write_csv, write_dots_csv,
    write_json_fields, write_record,
};
use domecast_runtime::traction::{ForceDistribution, write_json_forces};

/// Where the lines go: a file that is there whole or not at all, or standard output, frame by frame.
enum Sink {
    File(StagedFile),
    Standard(io::Stdout),
}

impl Sink {
    fn new(out: Option<&Path>, rules: &OutputRules<'_>) -> Result<Self, Failure> {
        Ok(match out {
            Some(path) => Self::File(StagedFile::new(path, "track", rules)?),
            None => Self::Standard(io::stdout()),
        })
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        match self {
            Self::File(file) => Ok(file.write(bytes)?),
            Self::Standard(out) => Ok(out.write_all(bytes).and_then(|()| out.flush())?),
        }
    }

    fn end(self, output: &Output) -> Result<(), Failure> {
        if let Self::File(file) = self {
            output.kept(file.commit()?);
        }
        Ok(())
    }
}

/// What stands before the lines.
fn header(format: Format) -> String {
    match format {
        Format::Jsonl | Format::Records => String::new(),
        Format::Csv => format!("{CSV_HEADER}\n"),
        Format::DotsCsv => format!("{DOTS_CSV_HEADER}\n"),
    }
}

/// Writes a frame's line or lines.
fn write_line(
    line: &mut Vec<u8>,
    arguments: &TrackArguments,
    tracked: &Tracked,
    at_mm: DVec3,
    forces: Option<&ForceDistribution>,
) -> io::Result<()> {
    match arguments.format {
        Format::Jsonl => match forces {
            Some(forces) => write_json_forces(line, tracked, &arguments.fields, forces.result()),
            None => write_json_fields(line, tracked, &arguments.fields),
        },
        Format::Csv => write_csv(line, tracked, at_mm),
        Format::DotsCsv => write_dots_csv(line, tracked),
        Format::Records => write_record(line, tracked, at_mm),
    }
}

/// Adds a member to a JSON line, which ends with `}` and a line feed.
pub fn add_member(line: &mut Vec<u8>, name: &str, value: &Value) {
    if line.ends_with(b"}\n") {
        line.truncate(line.len() - 2);
        line.extend_from_slice(format!(",\"{name}\":{value}}}\n").as_bytes());
    }
}

/// Lines, pictures, maps and the page of a run: all in their places at its end, or none.
pub(super) struct Results {
    sink: Sink,
    pictures: Pictures,
    shape: Option<ShapeFiles>,
    contact_hardness: Option<ContactHardnessLines>,
    hardness: Option<HardnessLines>,
    page: Option<(StagedFile, TrackReport)>,
    recording: Option<Recording>,
    at_mm: DVec3,
    line: Vec<u8>,
}

impl Results {
    /// Opens all that is asked for, and refuses what could not be written.
    pub fn open(
        output: &Output,
        arguments: &TrackArguments,
        rules: &OutputRules<'_>,
        constants: &Constants,
        tracker: &Tracker,
        rest: Option<&RestFrame>,
    ) -> Result<Self, Failure> {
        let at_mm = tracker.springs().map_or(DVec3::ZERO, Springs::at_mm);
        let pictures = Pictures::new(arguments, rules, constants, tracker)?;
        let shape = ShapeFiles::open(output, arguments, rules, constants, tracker, rest)?;
        let contact_hardness = ContactHardnessLines::open(arguments, constants, rest, at_mm)?;
        let model = |path: &PathBuf| {
            arguments.need_jsonl(path)?;
            HardnessLines::open((path, arguments.hardness_every), &arguments.tracker, rest, at_mm)
        };
        let hardness = arguments.hardness.as_ref().map(model).transpose()?;
        let sink = Sink::new(arguments.out.as_deref(), rules)?;
        let page = match &arguments.report {
            Some(path) => {
                let report =
                    TrackReport::new(&constants.design, tracker.optics(), at_mm, arguments.shape.is_some());
                Some((StagedFile::new(path, "track", rules)?, report))
            }
            None => None,
        };
        // last, for it is there at once
        let pace = RecordingPace::WithFrames;
        let begin = |path: &PathBuf| Recording::begin(output, path, "track", rules, constants, tracker, pace);
        let recording = arguments.mcap.as_ref().map(begin).transpose()?;
        Ok(Self {
            sink,
            pictures,
            shape,
            contact_hardness,
            hardness,
            page,
            recording,
            at_mm,
            line: Vec::new(),
        })
    }

    /// Writes what stands before the lines.
    pub fn begin(&mut self, arguments: &TrackArguments) -> Result<(), Failure> {
        self.sink.put(header(arguments.format).as_bytes())
    }

    /// Reads the frame's shape, where it is asked for.
    pub fn measure(&mut self, frame: &CameraFrame<'_>, tracked: &Tracked) -> Result<(), Failure> {
        self.shape.as_mut().map_or(Ok(()), |shape| shape.measure(frame, tracked))
    }

    /// The last frame's shape, where it is asked for.
    pub fn skin(&self) -> Option<&ShapeMap> {
        self.shape.as_ref().map(ShapeFiles::map)
    }

    /// Writes all of a frame, and of its file's bytes where it has a file; there is none where it could not be read.
    pub fn write(
        &mut self,
        output: &Output,
        arguments: &TrackArguments,
        frame: Option<&CameraFrame<'_>>,
        encoded: Option<&[u8]>,
        tracked: &Tracked,
        mut forces: Option<&mut ForceDistribution>,
    ) -> Result<(), Failure> {
        let number = tracked.frame;
        self.line.clear();
        write_line(&mut self.line, arguments, tracked, self.at_mm, forces.as_deref())?;
        if let (Some(_), Some(shape)) = (frame, &mut self.shape) {
            let line = (arguments.format == Format::Jsonl).then_some(&mut self.line);
            shape.write(number, line, forces.as_deref_mut())?;
        }
        let skin = frame.and(self.shape.as_ref()).map(ShapeFiles::map);
        let mut by_contact = None;
        if let (Some(touch), Some(forces)) = (&mut self.contact_hardness, forces.as_deref()) {
            let member;
            (by_contact, member) = touch.take(tracked, forces.result(), skin)?;
            add_member(&mut self.line, "contact_hardness", &member);
        }
        if let Some(lines) = &mut self.hardness
            && let Some(member) = lines.member(frame, tracked, skin, by_contact.as_ref())
        {
            add_member(&mut self.line, "hardness", &member);
        }
        self.sink.put(&self.line)?;
        if let Some(frame) = frame {
            let dots = forces.as_deref().map_or(&[][..], |forces| &forces.result().dots);
            let tractions: Vec<_> = dots.iter().map(|dot| (dot.surface_mm, dot.traction_n_mm2)).collect();
            self.pictures.write(output, number, frame, tracked, &tractions, skin)?;
        }
        if let Some((_, report)) = &mut self.page {
            report.add(tracked, skin);
        }
        if let Some(recording) = &mut self.recording {
            recording.add(time_ns(tracked), recorded(frame.copied(), encoded), tracked, skin)?;
        }
        Ok(())
    }

    /// Puts all in its place.
    pub fn end(self, output: &Output) -> Result<(), Failure> {
        self.sink.end(output)?;
        self.pictures.end(output)?;
        if let Some(touch) = self.contact_hardness {
            touch.warn(output);
        }
        if let Some(shape) = self.shape {
            shape.end(output)?;
        }
        if let Some((mut file, report)) = self.page {
            file.write(page(&report).as_str().as_bytes())?;
            output.kept(file.commit()?);
        }
        self.recording.map_or(Ok(()), Recording::end)
    }
}
