//! An object of a scene, resolved: its solid, and where it is over time.

use std::path::Path;

use glam::DVec3;

use super::motion::interpolate;
use super::objects::{ObjectSection, ShapeSection};
use domecast_contact::{ContactError, ContactSolid, Indenter};
use domecast_design::{DesignError, read_up_to};
use domecast_mesh::read_stl;
use domecast_optics::DomeShape;
use domecast_optics::numeric::{Rigid, rotation_from_vector};

/// A mesh of a million triangles has 50 MB; the contact needs far fewer.
const MAX_MESH_BYTES: u64 = 1 << 28;

/// An object that may touch the dome.
#[derive(Debug, Clone)]
pub struct SceneObject {
    /// Its name.
    pub name: String,
    /// Its solid and how it gives way.
    pub indenter: Indenter,
    path: Vec<(f64, [DVec3; 2])>,
    press: Option<(DVec3, Vec<(f64, f64)>)>,
}

/// How an object is held at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hold {
    /// At a pose, `rest_from_object`.
    At(Rigid),
    /// Pressed on from a pose, along a direction, with a force, N.
    Pressed(Rigid, DVec3, f64),
    /// Away from the dome.
    Away(Rigid),
}

impl SceneObject {
    pub(super) fn new(section: &ObjectSection, at: &str, folder: &Path) -> Result<Self, DesignError> {
        let solid = solid(&section.shape, &format!("{at}.shape"), folder)?;
        let path = section.path.iter().map(|key| {
            let turn = DVec3::from_array(key.rotation_deg.map(f64::to_radians));
            (key.time_s, [DVec3::from_array(key.position_mm), turn])
        });
        let press = section.press.as_ref().map(|press| -> Result<_, DesignError> {
            let way = DVec3::from_array(press.direction).try_normalize().ok_or_else(|| {
                DesignError::at(
                    format!("{at}.press.direction"),
                    serde_json::json!(press.direction),
                    "not a direction",
                    "three numbers that are not all zero",
                )
            })?;
            Ok((way, press.force.iter().map(|key| (key.time_s, key.force_n)).collect()))
        });
        Ok(Self {
            name: section.name.clone(),
            indenter: Indenter { solid, young_mpa: section.young_mpa, poisson: section.poisson },
            path: path.collect(),
            press: press.transpose()?,
        })
    }

    /// Its pose of the path, `rest_from_object`.
    pub fn pose_at(&self, time_s: f64) -> Rigid {
        let mix = |a: &[DVec3; 2], b: &[DVec3; 2], part: f64| [a[0].lerp(b[0], part), a[1].lerp(b[1], part)];
        let [place, turn] = interpolate(&self.path, time_s, mix);
        Rigid::new(rotation_from_vector(turn), place)
    }

    /// How it is held.
    pub fn hold_at(&self, time_s: f64) -> Hold {
        let pose = self.pose_at(time_s);
        match &self.press {
            None => Hold::At(pose),
            Some((way, force)) => {
                let force_n = interpolate(force, time_s, |a, b, part| a + (b - a) * part);
                if force_n > 0.0 { Hold::Pressed(pose, *way, force_n) } else { Hold::Away(pose) }
            }
        }
    }

    /// Whether it can touch a dome at a time, by its bounding sphere; true for one that is pressed on.
    pub fn may_touch(&self, time_s: f64, dome: &DomeShape) -> bool {
        match self.hold_at(time_s) {
            Hold::Pressed(..) => true,
            Hold::Away(_) => false,
            Hold::At(pose) => self.may_touch_at(&pose, dome),
        }
    }

    /// The same at a pose, `rest_from_object`.
    pub fn may_touch_at(&self, pose: &Rigid, dome: &DomeShape) -> bool {
        let (center, radius) = self.indenter.solid.bounding_sphere();
        dome.distance_mm(pose.point(center)) <= radius
    }
}

fn solid(shape: &ShapeSection, at: &str, folder: &Path) -> Result<ContactSolid, DesignError> {
    let fault = |error: ContactError| {
        let field = match &error {
            ContactError::Dimension { field, .. } => {
                format!("{at}.{}", field.rsplit('.').next().unwrap_or(field))
            }
            _ => at.to_owned(),
        };
        DesignError::at(field, "", error.to_string(), "a closed solid")
    };
    match shape {
        ShapeSection::Sphere { radius_mm } => ContactSolid::sphere(*radius_mm).map_err(fault),
        ShapeSection::Cylinder { radius_mm, length_mm } => {
            ContactSolid::cylinder(*radius_mm, *length_mm).map_err(fault)
        }
        ShapeSection::Box { size_mm } => ContactSolid::cuboid(DVec3::from_array(*size_mm)).map_err(fault),
        ShapeSection::Cone { radius_mm, height_mm } => {
            ContactSolid::cone(*radius_mm, *height_mm).map_err(fault)
        }
        ShapeSection::Mesh { file, scale } => {
            let path = folder.join(file);
            let field = format!("{at}.file");
            let unreadable = |problem: String| {
                DesignError::at(field.clone(), serde_json::json!(file), problem, "a closed STL file")
            };
            let bytes = std::fs::File::open(&path)
                .and_then(|file| read_up_to(file, MAX_MESH_BYTES))
                .map_err(|error| unreadable(format!("{} cannot be read ({error})", path.display())))?;
            let mut mesh = read_stl(&bytes).map_err(|error| unreadable(format!("not an STL ({error})")))?;
            mesh.vertices_mm.iter_mut().for_each(|vertex| *vertex *= *scale);
            ContactSolid::mesh(&mesh).map_err(|error| unreadable(error.to_string()))
        }
    }
}
