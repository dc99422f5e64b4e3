//! The golden cases as the script wrote them, and what may be done to a case
//! without changing its truth: turning, mirroring, scaling.

use std::fs;
use std::path::{Path, PathBuf};

use domecast::camera::{LensModel, LensSpec};
use domecast::numeric::Rigid;
use domecast::optics::{DomeShape, FlatLayer, OpticsSpec};
use glam::{DMat3, DVec2, DVec3};
use serde::Deserialize;

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct LensFile {
    pub model: String,
    pub width: u32,
    pub height: u32,
    pub matrix: [[f64; 3]; 3],
    pub distortion: Vec<f64>,
    pub field_of_view_deg: f64,
    #[serde(default)]
    pub pupil_shift_mm: Vec<f64>,
}

impl LensFile {
    pub fn spec(&self) -> LensSpec {
        LensSpec {
            model: LensModel::parse(&self.model).unwrap(),
            width: self.width,
            height: self.height,
            matrix: self.matrix,
            distortion: self.distortion.clone(),
            field_of_view_rad: self.field_of_view_deg.to_radians(),
            pupil_shift_mm: self.pupil_shift_mm.clone(),
        }
    }
}

#[derive(Debug, Clone, Deserialize)]
struct LayerFile {
    index: f64,
    thickness_mm: Option<f64>,
}

#[derive(Debug, Clone, Deserialize)]
struct TraceFile {
    pixel: [f64; 2],
    status: String,
    ray: Option<[String; 3]>,
    allowed_rad: Option<f64>,
    surface_mm: Option<[String; 3]>,
    allowed_mm: Option<f64>,
    field_angle_rad: Option<String>,
}

#[derive(Debug, Clone, Deserialize)]
struct ProjectFile {
    point_mm: [f64; 3],
    status: String,
    image_px: Option<[String; 2]>,
    allowed_px: Option<f64>,
}

#[derive(Debug, Clone, Deserialize)]
struct CaseFile {
    name: String,
    lens: LensFile,
    layers: Vec<LayerFile>,
    sensor_from_camera: [[f64; 4]; 4],
    dome_radius_mm: f64,
    max_field_angle_rad: String,
    limit: String,
    trace: Vec<TraceFile>,
    project: Vec<ProjectFile>,
}

/// What a pixel sees.
#[derive(Debug, Clone)]
pub struct Traced {
    pub pixel: DVec2,
    pub status: String,
    pub ray: Option<(DVec3, f64)>,
    pub surface_mm: Option<(DVec3, f64)>,
    pub field_angle_rad: Option<f64>,
}

/// Where a point is seen.
#[derive(Debug, Clone)]
pub struct Projected {
    pub point_mm: DVec3,
    pub status: String,
    pub image_px: Option<(DVec2, f64)>,
}

#[derive(Debug, Clone)]
pub struct Case {
    pub name: String,
    pub spec: OpticsSpec,
    pub max_field_angle_rad: f64,
    pub limit: String,
    pub trace: Vec<Traced>,
    pub project: Vec<Projected>,
}

fn numbers<const N: usize>(text: &[String; N]) -> [f64; N] {
    std::array::from_fn(|i| text[i].parse().unwrap())
}

fn read(file: CaseFile) -> Case {
    let layer = |l: &LayerFile| FlatLayer {
        name: "layer".to_owned(),
        index: [l.index; 3],
        thickness_mm: l.thickness_mm,
    };
    let traced = |t: TraceFile| Traced {
        pixel: DVec2::from_array(t.pixel),
        status: t.status,
        ray: t.ray.map(|r| (DVec3::from_array(numbers(&r)), t.allowed_rad.unwrap())),
        surface_mm: t.surface_mm.map(|s| (DVec3::from_array(numbers(&s)), t.allowed_mm.unwrap())),
        field_angle_rad: t.field_angle_rad.map(|a| a.parse().unwrap()),
    };
    let projected = |p: ProjectFile| Projected {
        point_mm: DVec3::from_array(p.point_mm),
        status: p.status,
        image_px: p.image_px.map(|i| (DVec2::from_array(numbers(&i)), p.allowed_px.unwrap())),
    };
    Case {
        name: file.name,
        spec: OpticsSpec {
            lens: file.lens.spec(),
            sensor_from_camera: Rigid::from_rows_4x4(&file.sensor_from_camera).unwrap(),
            layers: file.layers.iter().map(layer).collect(),
            dome: DomeShape::hemisphere(file.dome_radius_mm),
        },
        max_field_angle_rad: file.max_field_angle_rad.parse().unwrap(),
        limit: file.limit,
        trace: file.trace.into_iter().map(traced).collect(),
        project: file.project.into_iter().map(projected).collect(),
    }
}

/// The JSON files of a folder of `tests/cases`, by name; at least one.
pub fn files(folder: &str) -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases").join(folder);
    let entries = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> = entries.collect();
    paths.sort();
    assert!(!paths.is_empty(), "{} is empty", folder.display());
    let name = |path: &Path| path.file_stem().unwrap().to_string_lossy().into_owned();
    paths.iter().map(|path| (name(path), fs::read_to_string(path).unwrap())).collect()
}

/// A golden case from its text.
fn parsed((name, text): &(String, String)) -> CaseFile {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("golden-optics/{name}.json: {error}"))
}

/// `tests/cases/golden-optics`, by `scripts/golden_optics.py`.
pub fn golden() -> Vec<Case> {
    files("golden-optics").iter().map(|file| read(parsed(file))).collect()
}

#[test]
fn every_published_lens_has_golden_values() {
    let golden: Vec<CaseFile> = files("golden-optics").iter().map(parsed).collect();
    for (name, text) in files("lenses") {
        let lens: LensFile =
            serde_json::from_str(&text).unwrap_or_else(|error| panic!("lenses/{name}.json: {error}"));
        let case = golden.iter().find(|case| case.name == format!("published {name}"));
        let case = case.unwrap_or_else(|| panic!("{name}: run scripts/golden_optics.py"));
        assert_eq!(case.lens, lens, "{name}: run scripts/golden_optics.py");
    }
}

impl Case {
    fn points(&mut self, f: impl Fn(DVec3) -> DVec3) {
        for t in &mut self.trace {
            if let Some((surface, _)) = &mut t.surface_mm {
                *surface = f(*surface);
            }
        }
        for p in &mut self.project {
            p.point_mm = f(p.point_mm);
        }
    }

    fn rays(&mut self, f: impl Fn(DVec3) -> DVec3) {
        for t in &mut self.trace {
            if let Some((ray, _)) = &mut t.ray {
                *ray = f(*ray);
            }
        }
    }

    fn pixels(&mut self, f: impl Fn(DVec2) -> DVec2) {
        for t in &mut self.trace {
            t.pixel = f(t.pixel);
        }
        for p in &mut self.project {
            if let Some((pixel, _)) = &mut p.image_px {
                *pixel = f(*pixel);
            }
        }
    }

    fn decentring(&mut self, f: impl Fn(DVec2) -> DVec2) {
        if self.spec.lens.model == LensModel::BrownConrady {
            // (p2, p1) is a vector of the image plane.
            let k = &mut self.spec.lens.distortion;
            let q = f(DVec2::new(k[3], k[2]));
            (k[3], k[2]) = (q.x, q.y);
        }
    }

    /// All lengths times `factor`; a power of two changes no rounding.
    pub fn scaled(mut self, factor: f64) -> Self {
        self.name = format!("{} times {factor}", self.name);
        self.spec.dome = self.spec.dome.scaled_to(self.spec.dome.radius_mm() * factor);
        self.spec.sensor_from_camera.translation_mm *= factor;
        for layer in &mut self.spec.layers {
            if let Some(thickness) = &mut layer.thickness_mm {
                *thickness *= factor;
            }
        }
        for shift in &mut self.spec.lens.pupil_shift_mm {
            *shift *= factor;
        }
        self.points(|p| p * factor);
        for t in &mut self.trace {
            if let Some((_, allowed)) = &mut t.surface_mm {
                *allowed *= factor;
            }
        }
        self
    }

    /// The whole sensor, camera included, turned about the dome's axis.
    pub fn turned(mut self, angle_rad: f64) -> Self {
        self.name = format!("{} turned by {angle_rad}", self.name);
        let turn = DMat3::from_rotation_z(angle_rad);
        self.spec.sensor_from_camera = Rigid::new(turn, DVec3::ZERO).compose(&self.spec.sensor_from_camera);
        self.points(|p| turn * p);
        self
    }

    /// The camera turned about its own axis, its image with it.
    pub fn rolled(mut self, angle_rad: f64) -> Option<Self> {
        let [[fx, _, cx], [_, fy, cy], _] = self.spec.lens.matrix;
        if fx != fy {
            return None;
        }
        self.name = format!("{} rolled by {angle_rad}", self.name);
        let turn = DMat3::from_rotation_z(angle_rad);
        let flat = |v: DVec2| (turn * v.extend(0.0)).truncate();
        self.spec.sensor_from_camera =
            self.spec.sensor_from_camera.compose(&Rigid::new(turn.transpose(), DVec3::ZERO));
        self.decentring(flat);
        self.rays(|r| turn * r);
        self.pixels(|p| flat(p - DVec2::new(cx, cy)) + DVec2::new(cx, cy));
        Some(self)
    }

    /// The world, the camera and its image seen in a mirror, x against -x.
    pub fn mirrored(mut self) -> Self {
        self.name = format!("{} mirrored", self.name);
        let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
        let pose = &mut self.spec.sensor_from_camera;
        *pose = Rigid::new(mirror * pose.rotation * mirror, mirror * pose.translation_mm);
        self.decentring(|q| DVec2::new(-q.x, q.y));
        let cx = self.spec.lens.matrix[0][2];
        self.points(|p| mirror * p);
        self.rays(|r| mirror * r);
        self.pixels(|p| DVec2::new(cx - (p.x - cx), p.y));
        self
    }
}
