//! A build, read again from the disk: do its files still say one and the same thing?
//!
//! ```
//! use domecast_fab::build::check::check;
//! use std::path::Path;
//!
//! let fault = check(Path::new("no/such/folder"), &mut |_| ()).unwrap_err();
//! assert!(fault.to_string().contains("manifest.json"));
//! ```

use std::fs;
use std::path::Path;
use std::str::FromStr;

use glam::{DVec2, DVec3};

use super::manifest::{DESIGN_NAME, MANIFEST_NAME, Manifest, PartRecord};
use crate::artwork;
use crate::hash::sha256_hex;
use domecast_design::layout::Layout;
use domecast_design::{Design, DesignError};
use domecast_files::{list_files, marked_files};
use domecast_mesh::{inspect, read_stl};
use domecast_runtime::constants::Constants;

/// What a build promises of each dot: it lies on the dome, and its image is where the constants say.
const DOME_TOLERANCE_MM: f64 = 1e-9;
const PIXEL_TOLERANCE_PX: f64 = 1e-9;
/// The artwork's decimals (a nanometre) and the transfer map's slope stay far below this.
const ARTWORK_TOLERANCE_MM: f64 = 1e-4;
/// STL holds single precision: six to seven digits of each coordinate.
const VOLUME_TOLERANCE: f64 = 1e-5;

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// What was looked at.
    pub subject: String,
    /// Whether it is as it should be.
    pub holds: bool,
    /// Numbers, or what is wrong.
    pub detail: String,
}

/// Everything that was looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CheckReport {
    /// Name of the design.
    pub design: String,
    /// In the order of the look.
    pub findings: Vec<Finding>,
}

impl CheckReport {
    fn add(&mut self, subject: impl Into<String>, outcome: Result<String, String>) -> bool {
        let holds = outcome.is_ok();
        let (Ok(detail) | Err(detail)) = outcome;
        self.findings.push(Finding { subject: subject.into(), holds, detail });
        holds
    }
}

/// Reads the build in `dir` and verifies it; `step` gets what is being checked.
///
/// # Errors
/// Only where there is no build to look at: no folder, or no manifest that can be read. Everything else
/// that is wrong is a finding.
pub fn check(dir: &Path, step: &mut dyn FnMut(&str)) -> Result<CheckReport, DesignError> {
    let manifest = Manifest::read(dir, "a folder that `domecast build` wrote")?;
    let mut report = CheckReport { design: manifest.design.name.clone(), findings: Vec::new() };

    step("checking files and hashes");
    report.add("files", check_files(dir, &manifest));
    step("checking the design");
    let design = load_design(dir, &manifest);
    report.add(
        DESIGN_NAME,
        design.as_ref().map(|_| "resolves, its hash agrees".to_owned()).map_err(Clone::clone),
    );
    step("checking the dots");
    let constants = read(dir, "constants/constants.json")
        .and_then(|text| Constants::from_str(&text).map_err(|error| error.to_string()));
    match (&design, &constants) {
        (Ok(design), Ok(constants)) => check_constants(&mut report, dir, design, constants),
        (_, Err(problem)) => {
            report.add("constants/constants.json", Err(problem.clone()));
        }
        (Err(_), Ok(_)) => {}
    }
    for part in &manifest.parts {
        step(&format!("checking {}", part.file));
        report.add(part.file.clone(), check_mesh(dir, part));
    }
    Ok(report)
}

fn read(dir: &Path, path: &str) -> Result<String, String> {
    fs::read_to_string(dir.join(path)).map_err(|error| format!("cannot be read ({error})"))
}

/// Every listed file is there, whole; nothing else is.
fn check_files(dir: &Path, manifest: &Manifest) -> Result<String, String> {
    for file in &manifest.files {
        if !file.is_inside() {
            return Err(format!("{}: not a path inside the folder", file.path));
        }
        let bytes = fs::read(dir.join(&file.path)).map_err(|error| format!("{}: {error}", file.path))?;
        if !file.is_of(&bytes) {
            return Err(format!("{}: changed since the build (its hash differs)", file.path));
        }
    }
    let listed =
        |path: &String| path == MANIFEST_NAME || manifest.files.iter().any(|file| file.path == *path);
    let found = list_files(dir).map_err(|error| error.to_string())?;
    if let Some(path) = found.iter().find(|path| !listed(path)) {
        return Err(format!("{path}: not in the manifest"));
    }
    // the folder's marker lists what was written, whatever became of the manifest
    let written = marked_files(dir).unwrap_or_default();
    let named = manifest.parts.iter().map(|part| &part.file);
    match written.iter().chain(named).find(|path| !listed(path)) {
        Some(path) => Err(format!("{path}: was built, and is missing here and in the manifest")),
        None => Ok(format!("{} files, every hash agrees", manifest.files.len())),
    }
}

fn load_design(dir: &Path, manifest: &Manifest) -> Result<Design, String> {
    let text = read(dir, DESIGN_NAME)?;
    if sha256_hex(text.as_bytes()) != manifest.design.sha256 {
        return Err("is not the design that the manifest names (its hash differs)".into());
    }
    let design = Design::from_str(&text).map_err(|error| error.to_string())?;
    if design.name() == manifest.design.name {
        Ok(design)
    } else {
        Err(format!("is named \"{}\", the manifest says \"{}\"", design.name(), manifest.design.name))
    }
}

fn check_constants(report: &mut CheckReport, dir: &Path, design: &Design, constants: &Constants) {
    let layout = match Layout::of_design(design) {
        Ok(layout) => layout,
        Err(error) => {
            report.add("layout", Err(error.to_string()));
            return;
        }
    };
    let expected = crate::constants::of(design, &layout).map_err(|error| error.to_string());
    let camera = expected.and_then(|expected| {
        let same = expected.camera == constants.camera
            && expected.optics == constants.optics
            && expected.mask == constants.mask
            && expected.design == constants.design;
        if same {
            Ok("camera, layers and mask are the design's".to_owned())
        } else {
            Err("differ from the design".into())
        }
    });
    report.add("constants: camera and optics", camera);
    report.add("constants: dots on the dome", dots_on_dome(design, constants));
    report.add("constants: dots and markers in the image", dots_in_image(design, constants));
    report.add("constants: neighbours", neighbors(constants));
    // one film for each print pass; together they hold every dot once
    let films = (0..layout.passes.len()).map(|pass| read(dir, &artwork::film_path(pass, "svg")));
    let films: Result<Vec<String>, String> = films.collect();
    report.add("artwork: films", films.and_then(|texts| check_svg(&texts.join("\n"), &layout, constants)));
}

fn dots_on_dome(design: &Design, constants: &Constants) -> Result<String, String> {
    let dome = design.sections().dome.shape();
    let mut worst_mm = 0.0_f64;
    for dot in &constants.black_dots {
        let surface = DVec3::from_array(dot.surface_mm);
        let off_mm = dome
            .distance_mm(surface)
            .abs()
            .max((dome.normal(surface) - DVec3::from_array(dot.normal)).length());
        if off_mm.is_nan() || off_mm > DOME_TOLERANCE_MM || surface.z < 0.0 {
            return Err(format!("dot {} is {off_mm:.3e} mm off the dome of {} mm", dot.id, dome.radius_mm()));
        }
        worst_mm = worst_mm.max(off_mm);
    }
    Ok(format!("{} dots, at most {worst_mm:.1e} mm off", constants.black_dots.len()))
}

fn dots_in_image(design: &Design, constants: &Constants) -> Result<String, String> {
    let dots = constants.black_dots.iter().map(|dot| ("dot", dot.id, dot.surface_mm, dot.image_px));
    let markers = constants
        .white_markers
        .iter()
        .map(|marker| ("marker", marker.id, marker.position_mm, marker.image_px));
    let mut worst_px = 0.0_f64;
    for (kind, id, place_mm, image_px) in dots.chain(markers) {
        let image = design
            .optics()
            .project(DVec3::from_array(place_mm))
            .map_err(|limit| format!("{kind} {id} has no image ({limit})"))?;
        let off_px = image.distance(DVec2::from_array(image_px));
        if off_px.is_nan() || off_px > PIXEL_TOLERANCE_PX {
            return Err(format!("{kind} {id} is imaged {off_px:.3e} px beside its image_px"));
        }
        worst_px = worst_px.max(off_px);
    }
    Ok(format!("at most {worst_px:.1e} px off"))
}

fn neighbors(constants: &Constants) -> Result<String, String> {
    let dots = &constants.black_dots;
    for (index, dot) in dots.iter().enumerate() {
        if dot.id != index {
            return Err(format!("dot {index} has id {}", dot.id));
        }
        for other in &dot.neighbors {
            if *other == index || !dots.get(*other).is_some_and(|other| other.neighbors.contains(&index)) {
                return Err(format!("dot {index} names {other}, which does not name it back"));
            }
        }
    }
    let links: usize = dots.iter().map(|dot| dot.neighbors.len()).sum();
    Ok(format!("{} pairs, each named by both", links / 2))
}

/// Every dot of the drawing carries its id and its centre; mapped back, it lands on the dot's place on the dome.
fn check_svg(text: &str, layout: &Layout, constants: &Constants) -> Result<String, String> {
    let events = svg::read(text).map_err(|error| error.to_string())?;
    let mut seen = vec![false; constants.black_dots.len()];
    let mut worst_mm = 0.0_f64;
    for event in events {
        let attributes = match event {
            svg::parser::Event::Tag(_, _, attributes) => attributes,
            svg::parser::Event::Error(error) => return Err(format!("not readable: {error}")),
            _ => continue,
        };
        let Some(id) = attributes.get("data-id") else { continue };
        let number = |name: &str| attributes.get(name).and_then(|value| value.parse::<f64>().ok());
        let id: usize = id.parse().map_err(|_| format!("data-id \"{id}\" is no number"))?;
        let (Some(x_mm), Some(y_mm)) = (number("data-x-mm"), number("data-y-mm")) else {
            return Err(format!("dot {id} has no data-x-mm and data-y-mm"));
        };
        let (Some(dot), Some(laid_out), Some(seen)) =
            (constants.black_dots.get(id), layout.dots.get(id), seen.get_mut(id))
        else {
            return Err(format!("dot {id} is not in the constants"));
        };
        if std::mem::replace(seen, true) {
            return Err(format!("dot {id} is drawn twice"));
        }
        let on_pass = layout.transfer.dome_from_plate(DVec2::new(x_mm, y_mm));
        let on_pass = on_pass.map_err(|limit| format!("dot {id} lies outside the transfer map ({limit})"))?;
        let Some(pass) = layout.passes.get(laid_out.pass) else {
            return Err(format!("dot {id} belongs to no print pass"));
        };
        let surface = layout.dome.center_mm() + pass.pass_from_sensor.transpose() * on_pass;
        let off_mm = surface.distance(DVec3::from_array(dot.surface_mm));
        if off_mm.is_nan() || off_mm > ARTWORK_TOLERANCE_MM {
            return Err(format!("dot {id} lands {off_mm:.3e} mm beside its surface_mm"));
        }
        worst_mm = worst_mm.max(off_mm);
    }
    match seen.iter().position(|seen| !seen) {
        Some(id) => Err(format!("dot {id} is not drawn")),
        None => Ok(format!("{} dots land within {worst_mm:.1e} mm", seen.len())),
    }
}

fn check_mesh(dir: &Path, part: &PartRecord) -> Result<String, String> {
    let bytes = fs::read(dir.join(&part.file)).map_err(|error| format!("cannot be read ({error})"))?;
    let mesh = read_stl(&bytes).map_err(|error| error.to_string())?;
    let found = inspect(&mesh);
    if let Some(problem) = found.problem() {
        return Err(problem);
    }
    if found.genus() != Some(part.genus) {
        return Err(format!("has genus {:?}, {} was built", found.genus(), part.genus));
    }
    let volume_mm3 = mesh.volume_mm3();
    if (volume_mm3 - part.volume_mm3).abs() > VOLUME_TOLERANCE * part.volume_mm3 {
        return Err(format!("has {volume_mm3:.4} mm^3, {:.4} were built", part.volume_mm3));
    }
    Ok(format!("closed, one body, genus {}, {volume_mm3:.2} mm^3", part.genus))
}
