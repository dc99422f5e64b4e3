//! `domecast calibrate DEVICE --constants FILE`

mod ball;
mod capture;
mod loads;
mod noise;
mod outcome;
mod page;
mod session;
mod steps;
mod words;

use std::fs::File;
use std::io::{self, BufRead, BufReader, IsTerminal};
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::calibrate_light::light_json;
use super::input::input_fault;
use super::live::Device;
use super::output::{Failure, Output};
use domecast_live::source::ControlRequest;
use domecast_runtime::calibrate::light::LightFit;
use loads::{Load, LoadNoise};
use outcome::{Outcome, kind_of, solve};
use session::CalibrationSession;
use steps::{STEPS, Taking};

const MEASURED: &str = "constants.measured.json";
const PAGE: &str = "calibration.html";

/// Arguments of `domecast calibrate`.
#[derive(Debug, clap::Args)]
pub struct CalibrateArguments {
    /// Where frames come from: a camera (`/dev/video0`), `player:FOLDER`, or a folder of frames. A folder of folders has those
    /// of each step under its name: `01-rest`, `02-weight`, ..
    #[arg(value_name = "DEVICE")]
    device: String,
    /// The constants.json of the sensor as it was built: nominal ones.
    #[arg(long)]
    constants: PathBuf,
    /// The folder that keeps steps, frames and results: a wizard that was stopped goes on there.
    #[arg(long, value_name = "DIR", default_value = "calibration")]
    session: PathBuf,
    /// Answers to take instead of those that are typed, a line each; the first that is refused ends it.
    #[arg(long, value_name = "FILE")]
    answers: Option<PathBuf>,
    /// Frames that a step takes of a camera.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(2..=200))]
    frames: u16,
    /// How far a load may be off what is said of it: a part of the weight, degrees of its direction, mm of its place.
    #[arg(long, value_name = "PART,DEG,MM", default_value = "0.005,1,0.5", value_parser = load_sd)]
    load_sd: LoadNoise,
    /// Frames a second that a camera is asked for.
    #[arg(long, value_name = "HZ", default_value_t = 30.0, value_parser = super::live::rate)]
    rate: f64,
    /// Exposure time, ms [default: locked where it stands].
    #[arg(long, value_name = "MS", value_parser = super::live::milliseconds)]
    exposure: Option<f64>,
    /// Gain, in the camera's own steps [default: locked where it stands].
    #[arg(long)]
    gain: Option<i32>,
}

fn load_sd(text: &str) -> Result<LoadNoise, String> {
    let wrong =
        || format!("\"{text}\" is not three numbers from 0: a part up to 1, degrees up to 45, mm up to 100");
    let parts: Result<Vec<f64>, _> = text.split(',').map(|v| v.trim().parse()).collect();
    match parts.map_err(|_| wrong())?.as_slice() {
        [part, deg, mm]
            if (0.0..=1.0).contains(part) && (0.0..=45.0).contains(deg) && (0.0..=100.0).contains(mm) =>
        {
            Ok(LoadNoise { part: *part, turn_rad: deg.to_radians(), place_mm: *mm })
        }
        _ => Err(wrong()),
    }
}

/// A session at work.
struct Wizard<'a> {
    output: &'a Output,
    arguments: &'a CalibrateArguments,
    session: CalibrationSession,
    outcome: Outcome,
    /// The lights, once they are fitted.
    light: Option<LightFit>,
    is_done: bool,
}

/// Takes the steps that are answered, until `done` or the answers' end.
pub fn run(output: &Output, arguments: &CalibrateArguments) -> Result<(), Failure> {
    let session = CalibrationSession::open(output, &arguments.session, &arguments.constants)?;
    let outcome = solve(&session.nominal, &session.steps, &arguments.load_sd, &arguments.session)?;
    let mut wizard = Wizard { output, arguments, session, outcome, light: None, is_done: false };
    let typed = arguments.answers.is_none() && io::stdin().is_terminal();
    let lines: Box<dyn BufRead> = match &arguments.answers {
        Some(path) => {
            let file = File::open(path);
            let fault =
                |e: io::Error| input_fault(path, format!("cannot be read ({e})"), "a file of answers");
            Box::new(BufReader::new(file.map_err(fault)?))
        }
        None => Box::new(BufReader::new(io::stdin())),
    };
    let mut lines = lines.lines();
    wizard.help()?;
    wizard.tell()?;
    while !wizard.is_done {
        if typed {
            output.answer("> ")?;
        }
        let Some(line) = lines.next() else { break };
        let line = line?;
        match wizard.answer(line.trim()) {
            // at a terminal the step can be said again
            Err(failure @ (Failure::Input(_) | Failure::Write(_))) if typed => output.failure(&failure),
            other => other?,
        }
    }
    output.result(&wizard.result())
}

impl Wizard<'_> {
    fn help(&self) -> Result<(), Failure> {
        for kind in &STEPS {
            self.output.say(&format!("{:<24} {}", kind.form, kind.what))?;
        }
        self.output.say(&format!("{:<24} takes the last step back", "undo"))?;
        self.output.say(&format!("{:<24} writes {MEASURED} and {PAGE}", "done"))
    }

    /// What is known and what helps next.
    fn tell(&self) -> Result<(), Failure> {
        for note in &self.outcome.notes {
            self.output.say(note)?;
        }
        if let Some(optics) = &self.outcome.optics {
            let seen = optics.parameters.iter().filter(|p| p.observed).count();
            self.output.say(&format!(
                "optics: {seen} of {} numbers are known better than by tolerance; {:.3} px rms are left, {:.3} before",
                optics.parameters.len(),
                optics.rms_px[1],
                optics.rms_px[0]
            ))?;
        }
        if let Some(knowledge) = &self.outcome.knowledge {
            self.output.say(&format!("springs: {}", words::known(knowledge)))?;
        }
        if let Some(sd_px) = self.outcome.centroid_px.filter(|_| !self.outcome.loads.is_empty()) {
            self.output
                .say(&format!("markers: {sd_px:.3} px, one standard deviation, by the frames so far"))?;
        }
        if let Some(next) = self.next(self.best().as_ref()) {
            self.output.say(&format!("helps most next: {next}"))?;
        }
        match self.next_ball() {
            Some(next) => self.output.say(&format!("for the lights, {next}")),
            None => Ok(()),
        }
    }

    /// The load that helps most now.
    fn best(&self) -> Option<(Load, f64)> {
        let (knowledge, motion) = (self.outcome.knowledge.as_ref()?, self.outcome.motion?);
        loads::best(&self.outcome.constants, knowledge, &motion, &self.arguments.load_sd)
    }

    /// The answer that helps most now, with what [`Wizard::best`] found.
    fn next(&self, best: Option<&(Load, f64)>) -> Option<String> {
        match self.outcome.optics {
            None => Some("rest".into()),
            Some(_) => best.map(|(load, _)| load.answer()),
        }
    }

    /// The press that the lights want next, once there is one.
    fn next_ball(&self) -> Option<String> {
        ball::next(&self.outcome.constants, &self.session.steps)
    }

    fn answer(&mut self, line: &str) -> Result<(), Failure> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let Some((first, rest)) = words.split_first() else { return Ok(()) };
        match *first {
            "done" => return self.done(),
            "undo" => {
                let back = self.session.undo()?;
                self.outcome = self.solve()?;
                let name = back.map_or("nothing".to_owned(), |step| step.name);
                self.output.say(&format!("took back {name}"))?;
                return self.tell();
            }
            comment if comment.starts_with('#') => return Ok(()),
            _ => {}
        }
        let Some(kind) = STEPS.iter().find(|kind| kind.name == *first) else {
            let names: Vec<&str> = STEPS.iter().map(|kind| kind.name).collect();
            let allowed = format!("{}, undo or done", names.join(", "));
            return Err(input_fault(Path::new(line), "is no step", &allowed));
        };
        let arguments = self.arguments;
        let controls =
            ControlRequest { exposure_ms: arguments.exposure, gain: arguments.gain, ..Default::default() };
        let taking = Taking {
            session: &self.session,
            constants: &self.outcome.constants,
            device: Device { name: &arguments.device, rate_hz: arguments.rate, controls },
            frames: arguments.frames.into(),
            words: rest,
            said: line,
        };
        let earlier: Vec<&str> = self.session.steps.iter().map(kind_of).collect();
        self.output.step(line);
        let (step, frames) = steps::take(&taking, kind, &earlier)?;
        // what all steps say together decides whether this one is kept
        let mut steps = self.session.steps.clone();
        steps.push(step.clone());
        let outcome = solve(&self.session.nominal, &steps, &arguments.load_sd, Path::new(line))?;
        self.session.keep(self.output, step, &frames)?;
        self.outcome = outcome;
        self.output.steps_done();
        self.output.say(&format!("took {line}"))?;
        self.tell()
    }

    fn solve(&self) -> Result<Outcome, Failure> {
        let session = &self.session;
        solve(&session.nominal, &session.steps, &self.arguments.load_sd, &self.arguments.session)
    }

    fn done(&mut self) -> Result<(), Failure> {
        let fault =
            |problem: String| input_fault(&self.arguments.session, problem, "frames at rest, at least");
        let measured = self.outcome.measured().map_err(fault)?;
        let measured = measured.ok_or_else(|| fault("there is nothing to write: no step `rest`".into()))?;
        let pressed = self.session.steps.iter().filter(|step| kind_of(step) == ball::BALL).count();
        if pressed > 0 {
            self.output.step(&format!("fitting the light to {pressed} presses"));
        }
        self.light = ball::fit_light(&self.session, &measured)?;
        let page = page::page(&self.session, &self.outcome, self.light.as_ref());
        let constants = self.light.as_ref().map_or(&measured, |light| &light.constants).to_json();
        let files = [(MEASURED, constants.as_bytes()), (PAGE, page.as_str().as_bytes())];
        self.session.write_results(self.output, &files)?;
        self.is_done = true;
        self.output.steps_done();
        for name in [MEASURED, PAGE] {
            self.output.say(&format!("wrote {}", self.session.path(name).display()))?;
        }
        Ok(())
    }

    fn result(&self) -> Value {
        let step = |step: &session::Step| json!({ "name": step.name, "said": step.said });
        let written = |name: &str| self.is_done.then(|| self.session.path(name).display().to_string());
        let best = self.best();
        json!({
            "steps": self.session.steps.iter().map(step).collect::<Vec<_>>(),
            "known": self.outcome.knowledge.as_ref().map(words::known_json),
            "next": self.next(best.as_ref()),
            "centroid_px": self.outcome.centroid_px,
            "next_gain": best.map(|(_, gain)| gain),
            "surprises": self.outcome.loads.iter().map(|load| load.surprise).collect::<Vec<_>>(),
            "next_ball": self.next_ball(),
            "light": self.light.as_ref().map(light_json),
            "constants": written(MEASURED),
            "page": written(PAGE),
        })
    }
}
