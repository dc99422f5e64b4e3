//! What a pose or a load runs into first.

use glam::DVec3;

use super::load::Wrench;
use super::state::{Displacement, Equilibrium, MechanicsError, SpringState};
use super::suspension::Suspension;
use domecast_optics::numeric::Rigid;

/// The limits that end a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Limit {
    /// A spring's coils lie on each other.
    CoilBind,
    /// The wire's corrected shear stress passes what it bears.
    WireOverStressed,
    /// A spring's end is pulled or tipped off its magnet.
    SpringLeavesMagnet,
    /// A spring bows out between its ends.
    SpringBuckles,
    /// The upper platform meets the lower one, or a stop made for it.
    PlatformsTouch,
    /// The sheet meets the camera.
    CameraGapCloses,
    /// The platform tips over: the tangent stiffness is not positive any more, or no balance exists.
    PlatformTips,
    /// A white marker leaves what the lens can see.
    MarkerOutOfLens,
    /// A white marker leaves the runtime's mask or the frame.
    MarkerOutOfMask,
    /// A white marker goes behind the edge of the platform's opening.
    MarkerBehindEdge,
}

impl Limit {
    /// Its name in tables and files.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::CoilBind => "coil_bind",
            Self::WireOverStressed => "wire_over_stressed",
            Self::SpringLeavesMagnet => "spring_leaves_magnet",
            Self::SpringBuckles => "spring_buckles",
            Self::PlatformsTouch => "platforms_touch",
            Self::CameraGapCloses => "camera_gap_closes",
            Self::PlatformTips => "platform_tips",
            Self::MarkerOutOfLens => "marker_out_of_lens",
            Self::MarkerOutOfMask => "marker_out_of_mask",
            Self::MarkerBehindEdge => "marker_behind_edge",
        }
    }
}

/// How far a limit is used up at a pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// Which limit.
    pub limit: Limit,
    /// Which part comes nearest to it: `spring 2`, `corner 0`, ..
    pub part: String,
    /// The quantity that is limited.
    pub value: f64,
    /// What it may be at most.
    pub bound: f64,
    /// Unit of both: `mm`, `MPa`, `N`, `1`, `px`, `rad`.
    pub unit: &'static str,
}

impl Check {
    /// The part of the limit that is used; above 1 it is passed. A bound of 0 is used up by any positive value.
    pub fn used(&self) -> f64 {
        if self.bound > 0.0 {
            self.value / self.bound
        } else if self.value > 0.0 {
            f64::MAX
        } else {
            0.0
        }
    }

    /// Whether the limit is passed, beyond rounding.
    pub fn is_passed(&self) -> bool {
        self.used() > 1.0 + 1e-12
    }
}

/// A part that moves with the platform and must stay above a level of the rest frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// What meets: `corner`, `sheet over the camera`, ..
    pub name: String,
    /// The limit that it stands for.
    pub limit: Limit,
    /// Its shape, sensor frame.
    pub shape: StopShape,
    /// The level that it may not pass, rest frame, mm.
    pub floor_z_mm: f64,
}

/// The shape of a stop.
#[derive(Debug, Clone, PartialEq)]
pub enum StopShape {
    /// Single points.
    Points(Vec<DVec3>),
    /// A flat disc, parallel to the sheet.
    Disc {
        /// Its centre, mm.
        center_mm: DVec3,
        /// Its radius, mm.
        radius_mm: f64,
    },
}

impl Stop {
    /// Lowest point of the shape at a pose: its number (0 for a disc) and z in the rest frame.
    fn lowest(&self, pose: &Rigid) -> Option<(usize, f64)> {
        match &self.shape {
            StopShape::Points(points) => {
                points.iter().map(|p| pose.point(*p).z).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
            }
            StopShape::Disc { center_mm, radius_mm } => {
                let r = &pose.rotation;
                let tilt = r.x_axis.z.hypot(r.y_axis.z);
                Some((0, pose.point(*center_mm).z - radius_mm * tilt))
            }
        }
    }
}

/// The mechanical limits of a sensor besides those of its springs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Limits {
    /// Pull at which a spring's end leaves its magnet, N; `None`: the ends are glued.
    pub grip_force_n: Option<f64>,
    /// What may meet what.
    pub stops: Vec<Stop>,
}

/// A load tried on the suspension.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadCase {
    /// The wrench about the suspension's reference point.
    pub wrench: Wrench,
    /// The balance, or why there is none.
    pub equilibrium: Result<Equilibrium, MechanicsError>,
    /// What each spring bears (empty without a balance).
    pub springs: Vec<SpringState>,
    /// One line for each limit, the most used first.
    pub checks: Vec<Check>,
}

impl LoadCase {
    /// The limits that this load passes, the worst first.
    pub fn passed(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| check.is_passed())
    }

    /// Adds checks that this module cannot make (what the camera sees), keeping the order.
    pub fn extend(&mut self, checks: impl IntoIterator<Item = Check>) {
        self.checks.extend(checks);
        sort_worst_first(&mut self.checks);
    }
}

/// Sorts by use, the most used first; ties by the limit's order.
pub fn sort_worst_first(checks: &mut [Check]) {
    checks.sort_by(|a, b| b.used().total_cmp(&a.used()).then(a.limit.cmp(&b.limit)));
}

/// Puts a wrench on the suspension and checks every mechanical limit.
pub fn try_load(suspension: &Suspension, limits: &Limits, wrench: &Wrench) -> LoadCase {
    let equilibrium = suspension.equilibrium(wrench);
    let mut case = LoadCase { wrench: *wrench, equilibrium, springs: Vec::new(), checks: Vec::new() };
    let found = match &case.equilibrium {
        Ok(balance) => checks_at(suspension, limits, &balance.displacement).map(|found| {
            let tipping = Check {
                limit: Limit::PlatformTips,
                part: "platform".into(),
                // Falls from the stiffness at rest to zero where it tips.
                value: 1.0 - stiffness_left(suspension, balance),
                bound: 1.0,
                unit: "1",
            };
            (found.0, found.1, tipping)
        }),
        Err(error) => Err(error.clone()),
    };
    match found {
        Ok((springs, mut checks, tipping)) => {
            checks.push(tipping);
            sort_worst_first(&mut checks);
            case.springs = springs;
            case.checks = checks;
        }
        Err(error) => {
            let carried = match error {
                MechanicsError::NotCarried { carried, .. } => carried,
                _ => 0.0,
            };
            // The load over the part of it that has a balance.
            let value = if carried > 0.0 { 1.0 / carried } else { f64::MAX };
            let check =
                Check { limit: Limit::PlatformTips, part: "platform".into(), value, bound: 1.0, unit: "1" };
            case.checks = vec![check];
        }
    }
    case
}

/// Least stiffness at a balance over that at rest.
fn stiffness_left(suspension: &Suspension, balance: &Equilibrium) -> f64 {
    let rest = suspension.min_stiffness_at(&Displacement::default()).unwrap_or(0.0);
    if rest > 0.0 { balance.min_stiffness_n_per_mm / rest } else { 0.0 }
}

/// Every mechanical limit at a pose, the most used first: one line for each limit, with the part nearest to it.
///
/// # Errors
/// As [`Suspension::springs_at`].
pub fn checks_at(
    suspension: &Suspension,
    limits: &Limits,
    displacement: &Displacement,
) -> Result<(Vec<SpringState>, Vec<Check>), MechanicsError> {
    let springs = suspension.springs_at(displacement)?;
    let spring = &suspension.spec().spring;
    let mut checks = Vec::new();
    let mut add = |limit, bound, unit, value: fn(&SpringState) -> f64| {
        let worst = springs.iter().map(value).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((number, value)) = worst {
            checks.push(Check { limit, part: format!("spring {number}"), value, bound, unit });
        }
    };
    add(Limit::CoilBind, spring.solid_compression_mm(), "mm", |s| s.compression_mm);
    add(Limit::WireOverStressed, spring.spec().allowable_shear_mpa, "MPa", |s| s.stress_mpa);
    add(Limit::SpringBuckles, 1.0, "1", |s| s.buckling_ratio);
    if let Some(grip) = limits.grip_force_n {
        add(Limit::SpringLeavesMagnet, grip, "N", |s| s.pull_n.max(0.0));
    }
    let pose = displacement.to_pose(suspension.at_mm());
    let rest = Rigid::identity();
    for stop in &limits.stops {
        if let (Some((number, z)), Some((_, rest_z))) = (stop.lowest(&pose), stop.lowest(&rest)) {
            let bound = rest_z - stop.floor_z_mm;
            let part = match stop.shape {
                StopShape::Points(_) => format!("{} {number}", stop.name),
                StopShape::Disc { .. } => stop.name.clone(),
            };
            checks.push(Check { limit: stop.limit, part, value: rest_z - z, bound, unit: "mm" });
        }
    }
    sort_worst_first(&mut checks);
    Ok((springs, checks))
}
