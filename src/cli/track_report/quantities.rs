//! What is drawn over time, and how.

use domecast_optics::numeric::Rigid;
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::Tracked;
use domecast_springs::{Displacement, Wrench};
use glam::DVec3;

/// A kind of number that frames have.
#[derive(Debug, Clone, Copy)]
pub struct Quantity {
    /// Its name in the page's data, with the unit.
    pub key: &'static str,
    /// That of its deviations, where it has some.
    pub sd_key: Option<&'static str>,
    /// What it is.
    pub title: &'static str,
    /// The unit that the page shows.
    pub unit: &'static str,
    /// That unit's number for one of the data's.
    pub factor: f64,
    /// The names of its components: three, or one.
    pub components: &'static [&'static str],
    /// The axis spans at least so much, in the page's unit: less is noise.
    pub min_span: f64,
}

const XYZ: &[&str] = &["x", "y", "z"];

/// All of them.
pub const QUANTITIES: [Quantity; 6] = [
    Quantity {
        key: "force_n",
        sd_key: Some("force_sd_n"),
        title: "Force",
        unit: "N",
        factor: 1.0,
        components: XYZ,
        min_span: 0.1,
    },
    Quantity {
        key: "torque_nmm",
        sd_key: Some("torque_sd_nmm"),
        title: "Torque",
        unit: "N·mm",
        factor: 1.0,
        components: XYZ,
        min_span: 1.0,
    },
    Quantity {
        key: "translation_mm",
        sd_key: Some("translation_sd_mm"),
        title: "Shift",
        unit: "mm",
        factor: 1.0,
        components: XYZ,
        min_span: 0.02,
    },
    Quantity {
        key: "rotation_rad",
        sd_key: Some("rotation_sd_rad"),
        title: "Turn",
        unit: "mrad",
        factor: 1e3,
        components: XYZ,
        min_span: 1.0,
    },
    Quantity {
        key: "contact_depth_mm",
        sd_key: Some("contact_depth_sd_mm"),
        title: "Depth of the contact",
        unit: "mm",
        factor: 1.0,
        components: &["depth"],
        min_span: 0.02,
    },
    Quantity {
        key: "contact_area_mm2",
        sd_key: None,
        title: "Area of the contact",
        unit: "mm²",
        factor: 1.0,
        components: &["area"],
        min_span: 1.0,
    },
];

/// A frame's number of one quantity, in the data's unit; of one component only the first counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// The value.
    pub value: DVec3,
    /// Its standard deviation.
    pub sd: Option<DVec3>,
}

impl Quantity {
    /// The components of a value in the page's unit, and their length where there are three.
    pub fn shown(&self, value: DVec3) -> Vec<f64> {
        let value = value * self.factor;
        match self.components.len() {
            1 => vec![value.x],
            _ => vec![value.x, value.y, value.z, value.length()],
        }
    }

    /// The names of these.
    pub fn names(&self) -> Vec<&'static str> {
        let length = (self.components.len() == 3).then_some("magnitude");
        self.components.iter().copied().chain(length).collect()
    }
}

/// What a frame says of each quantity. Where the skin was read and nothing touches it, depth and area are 0.
pub fn readings(
    tracked: &Tracked,
    skin: Option<&ShapeMap>,
    at_mm: DVec3,
) -> [Option<Reading>; QUANTITIES.len()] {
    let reading = |value: DVec3, sd: Option<DVec3>| {
        let sd = sd.filter(|sd| sd.is_finite());
        value.is_finite().then_some(Reading { value, sd })
    };
    let wrench = |part: fn(&Wrench) -> DVec3| {
        tracked.wrench.as_ref().and_then(|of| reading(part(of), tracked.wrench_sd.as_ref().map(part)))
    };
    let displacement = |part: fn(&Displacement) -> DVec3| {
        let of = |pose: &Rigid| part(&Displacement::of_pose(pose, at_mm));
        tracked.pose.as_ref().and_then(|pose| reading(of(pose), tracked.pose_sd.as_ref().map(part)))
    };
    let contact = skin.filter(|map| map.status.is_some()).map(|map| map.contact.as_ref());
    let depth = contact.and_then(|touch| match touch {
        Some(touch) => reading(DVec3::splat(touch.depth_mm), Some(DVec3::splat(touch.depth_sd_mm))),
        None => reading(DVec3::ZERO, None),
    });
    let area =
        contact.and_then(|touch| reading(DVec3::splat(touch.map_or(0.0, |touch| touch.area_mm2)), None));
    [
        wrench(|w| w.force_n),
        wrench(|w| w.moment_nmm),
        displacement(|d| d.translation_mm),
        displacement(|d| d.rotation_rad),
        depth,
        area,
    ]
}
