//! The sensor at one time: its pose, its shape, and the camera over it.

use crate::SimError;
use crate::contact::shape::SkinShape;
use crate::effect_name::EffectName;
use crate::raster::projector::{PlacedProjector, Projector};
use crate::raster::settings::Geometry;
use crate::scene::State;
use crate::work::Work;
use domecast_optics::numeric::Rigid;

/// Counted work of one point: a straight ray through the lens, and what each effect adds.
pub(crate) mod units {
    /// Straight ray and pinhole.
    pub const STRAIGHT: u64 = 20;
    /// The lens's polynomial.
    pub const LENS: u64 = 20;
    /// The pupil that belongs to the field angle: a bracketed root around the whole ray.
    pub const PUPIL: u64 = 600;
    /// The climb to the refracted ray.
    pub const BEND: u64 = 80;
    /// A corner of a polygon drawn.
    pub const CORNER: u64 = 15;
    /// A pixel blended.
    pub const PIXEL: u64 = 2;
    /// A balance of the springs.
    pub const BALANCE: u64 = 20_000;
}

/// The sensor at one time.
#[derive(Debug, Clone)]
pub struct SensorState {
    /// When, s.
    pub time_s: f64,
    /// Pose and load as they are, also where the picture leaves the pose out.
    pub state: State,
    /// The camera over it.
    pub eye: PlacedProjector,
    /// The touched dome.
    pub shape: SkinShape,
}

impl SensorState {
    /// The sensor in a state.
    ///
    /// # Errors
    /// A pose that cannot be.
    pub fn new(
        eye: &Projector,
        geometry: Geometry,
        time_s: f64,
        state: State,
        shape: SkinShape,
        work: &mut Work,
    ) -> Result<Self, SimError> {
        let pose = if geometry.sheet_motion {
            work.add(EffectName::SheetMotion, units::BALANCE);
            state.pose
        } else {
            Rigid::identity()
        };
        let eye = eye.at(&pose)?;
        Ok(Self { time_s, state, eye, shape })
    }
}

/// Counts the work of projecting points with the effects that take part.
pub fn count_points(geometry: Geometry, channels: usize, central: bool, points: u64, work: &mut Work) {
    let mut one = Work::default();
    one.add_base(points * units::STRAIGHT);
    if geometry.lens_distortion {
        one.add(EffectName::LensDistortion, points * units::LENS);
    }
    if geometry.pupil_shift && !central {
        one.add(EffectName::PupilShift, points * units::PUPIL);
    }
    if geometry.refraction && geometry.solves() {
        let solver = if geometry.gap_change { EffectName::GapChange } else { EffectName::Refraction };
        one.add(solver, points * units::BEND);
    }
    // What further colours do is the dispersion's.
    let again = one.total() * (channels.max(1) as u64 - 1);
    work.merge(&one);
    if again > 0 {
        work.add(EffectName::Dispersion, again);
    }
}
