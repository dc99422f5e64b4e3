//! What a wizard keeps: the constants it began with, and a folder for each step.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::commands::calibrate_optics::{observations_of, table_of};
use crate::commands::input::{input_fault, read_constants};
use crate::commands::output::{Failure, Output};
use domecast_design::read_text;
use domecast_files::{StagedFile, StagedFolder, replace_file};
use domecast_live::frame_files::{numbered, pictures_in, read_whole};
use domecast_runtime::calibrate::optics::Observation;
use domecast_runtime::constants::Constants;

const FORMAT: &str = "domecast-calibration-session";
const INDEX: &str = "session.json";
const CONSTANTS: &str = "constants.json";
const CENTROIDS: &str = "centroids.csv";
/// The camera's calibration in the folder of its step.
const CAMERA: &str = "camera.txt";
/// Where a ball was pressed, in the folder of its step.
const PLACE: &str = "place.json";
/// The frames in the folder of their step.
const FRAMES: &str = "frames";
const ALLOWED: &str = "the folder of an earlier `domecast calibrate`, or a new name";

/// A step that was taken.
#[derive(Debug, Clone)]
pub struct Step {
    /// Its folder: `02-weight`.
    pub name: String,
    /// The answer that it was taken with.
    pub said: String,
    /// The marks in its frames, which are numbered from 0.
    pub marks: Vec<Observation>,
    /// The camera's calibration file, of the step `lens`.
    pub camera: Option<String>,
    /// Where a ball was pressed, of the step `ball`: from the pole and about the axis, degrees.
    pub place_deg: Option<[f64; 2]>,
}

/// The folder of a wizard and its steps.
pub struct CalibrationSession {
    folder: PathBuf,
    /// The constants that it began with.
    pub nominal: Constants,
    pub steps: Vec<Step>,
}

impl CalibrationSession {
    /// Opens a session, or begins one: the constants are copied into it.
    pub fn open(output: &Output, folder: &Path, constants_path: &Path) -> Result<Self, Failure> {
        let nominal = read_constants(constants_path)?;
        let index = folder.join(INDEX);
        if !index.exists() {
            let mut file =
                StagedFile::new(&folder.join(CONSTANTS), "calibrate", &output.rules(&[constants_path]))?;
            file.write(nominal.to_json().as_bytes())?;
            output.kept(file.commit()?);
            let session = Self { folder: folder.to_path_buf(), nominal, steps: Vec::new() };
            session.write()?;
            return Ok(session);
        }
        let fault = |problem: String| input_fault(&index, problem, ALLOWED);
        let tree: Value = serde_json::from_str(&read_text(&index)?).map_err(|e| fault(e.to_string()))?;
        if tree["format"] != FORMAT || tree["version"] != 1 {
            return Err(fault("is no session of this version".into()));
        }
        let own = read_constants(&folder.join(CONSTANTS))?;
        if own != nominal {
            let problem = format!("was begun with other constants than {}", constants_path.display());
            return Err(fault(problem));
        }
        let steps = tree["steps"].as_array().ok_or_else(|| fault("has no steps".into()))?;
        let text = |step: &Value, key: &str| {
            step[key].as_str().map(str::to_owned).ok_or_else(|| fault(format!("a step has no {key}")))
        };
        let mut session = Self { folder: folder.to_path_buf(), nominal, steps: Vec::new() };
        for step in steps {
            let (name, said) = (text(step, "name")?, text(step, "said")?);
            if !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-') {
                return Err(fault(format!("the step \"{name}\" is no folder of this session")));
            }
            let place = session.folder.join(&name);
            let (table, camera) = (place.join(CENTROIDS), place.join(CAMERA));
            let marks = match table.exists() {
                true => observations_of(&read_text(&table)?)
                    .map_err(|e| input_fault(&table, e.to_string(), ALLOWED))?,
                false => Vec::new(),
            };
            let camera = camera.exists().then(|| read_text(&camera)).transpose()?;
            let place = place.join(PLACE);
            let place_deg = match place.exists() {
                true => serde_json::from_str(&read_text(&place)?)
                    .map_err(|e| input_fault(&place, e.to_string(), ALLOWED))?,
                false => None,
            };
            session.steps.push(Step { name, said, marks, camera, place_deg });
        }
        Ok(session)
    }

    /// The name of the next step.
    pub fn next_name(&self, kind: &str) -> String {
        format!("{:02}-{kind}", self.steps.len() + 1)
    }

    /// Keeps a step with its frames (PNG): its folder whole, and then the list that names it. What stops it between the two leaves a folder
    /// that the next step of that number replaces.
    pub fn keep(&mut self, output: &Output, step: Step, frames: &[Vec<u8>]) -> Result<(), Failure> {
        let staged = StagedFolder::new(&self.folder.join(&step.name), "calibrate", &output.rules(&[]))?;
        for (number, bytes) in frames.iter().enumerate() {
            staged.write(&format!("{FRAMES}/frame_{number:04}.png"), bytes)?;
        }
        if !step.marks.is_empty() {
            staged.write(CENTROIDS, table_of(&step.marks).as_bytes())?;
        }
        if let Some(camera) = &step.camera {
            staged.write(CAMERA, camera.as_bytes())?;
        }
        if let Some(place_deg) = step.place_deg {
            staged.write(PLACE, format!("{}\n", json!(place_deg)).as_bytes())?;
        }
        output.kept(staged.commit()?);
        self.steps.push(step);
        self.write()
    }

    /// The frames of a step that was kept, PNG.
    pub fn frames_of(&self, step: &Step) -> Result<Vec<Vec<u8>>, Failure> {
        let folder = self.folder.join(&step.name).join(FRAMES);
        let fault =
            |path: &Path, e: std::io::Error| input_fault(path, format!("cannot be read ({e})"), ALLOWED);
        let files = pictures_in(&folder).map_err(|e| fault(&folder, e))?;
        numbered(files).iter().map(|(_, path)| read_whole(path).map_err(|e| fault(path, e))).collect()
    }

    /// Takes the last step back; its frames stay until another takes its number.
    pub fn undo(&mut self) -> Result<Option<Step>, Failure> {
        let last = self.steps.pop();
        self.write()?;
        Ok(last)
    }

    fn write(&self) -> Result<(), Failure> {
        let step = |step: &Step| json!({ "name": step.name, "said": step.said });
        let tree = json!({
            "format": FORMAT, "version": 1, "steps": self.steps.iter().map(step).collect::<Vec<_>>(),
        });
        Ok(replace_file(&self.folder.join(INDEX), format!("{tree:#}\n").as_bytes())?)
    }

    /// Where a result of the session goes.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Writes results, each whole.
    pub fn write_results(&self, output: &Output, files: &[(&str, &[u8])]) -> Result<(), Failure> {
        for (name, bytes) in files {
            let mut file = StagedFile::new(&self.path(name), "calibrate", &output.rules(&[]))?;
            file.write(bytes)?;
            output.kept(file.commit()?);
        }
        Ok(())
    }
}
