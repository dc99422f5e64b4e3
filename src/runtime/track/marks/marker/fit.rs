//! The fit of a disc beside the dome to its pixels.

use glam::DVec2;
use nalgebra::SVector;

use super::candidates::MIN_RISE;
use super::equations::WindowSums;
use super::surroundings::fit_apart;
use super::view::MarkerView;
use crate::track::frame::Plane;
use crate::track::marks::MarkState;

/// A fit may go so far from its candidate, px.
pub(in crate::track) const FIT_REACH_PX: f64 = 4.0;
const MAX_STEPS: u32 = 12;
/// A step below this ends the fit, px; the next one would be a tenth of it.
const CONVERGED_PX: f64 = 4e-3;
/// Longest step, px.
const MAX_STEP_PX: f64 = 1.5;
/// Least difference between marker and ground in parts of the noise of one pixel.
const MIN_RISE_IN_NOISE: f64 = 3.0;
/// Largest part of the contrast that the picture of a disc may leave unexplained.
const MAX_MISFIT: f64 = 0.25;
/// Noise makes the octants of an outline differ; what is more than this times its variance does not come from it: of sixteen
/// normal deviates the mean square is beyond three in one case of 40,000.
const FREE_OF_NOISE: f64 = 3.0;
/// Markers that may be farther off than this are faulty: px, and in parts of the radius. A tenth of a pixel is hundredths of
/// a newton.
const MAX_SD_PX: f64 = 0.1;
const MAX_SD_RADII: f64 = 0.02;
/// What is around a disc and differs from octant to octant by more than the first part of the disc's contrast moves the fit,
/// by up to a pixel times what is more, as a soft lens does too; by more than the second it is fitted apart.
const EVEN: f64 = 0.025;
const MAX_UNEVENNESS: f64 = 0.075;
const MOVED_BY_UNEVENNESS_PX: f64 = 1.0;
/// Smaller discs have too few pixels for a fit apart from their surroundings.
const MIN_APART_RADIUS_PX: f64 = 3.0;
/// Pixels between a disc's middle and the frame's border.
const BORDER_PX: f64 = 2.0;

/// A disc as it was fitted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::track) struct FittedDisc {
    pub centroid_px: DVec2,
    /// Standard deviation of the centroid on each axis, px: the frame's noise, and what does not look like a disc.
    pub sd_px: f64,
    /// The same from the frame's noise alone, px.
    pub noise_sd_px: f64,
    /// Part of the contrast that the picture of a disc leaves unexplained, by rms.
    pub misfit: f64,
    /// The disc's radius in the image, px.
    pub radius_px: f64,
    /// Why it does not look like a marker, if it does not.
    pub fault: Option<MarkState>,
    /// Levels of ground, disc and dome, the last two counted from the ground: a start for the next frame.
    pub levels: [f64; 3],
    /// By what part of itself the disc's level rises in a px, as this frame shows it; `None` where too little of it is
    /// flat.
    pub shading: Option<DVec2>,
}

impl MarkerView {
    /// The disc near `start`, at most `stray_px` from it: Gauss-Newton on the pixels, for the place, the levels of
    /// ground, disc and dome; `levels`: those of the last frame, if there was one; `shading`: how the light falls off.
    ///
    /// `None` where the steps leave the frame or `stray_px` or do not converge in [`MAX_STEPS`], and where what is
    /// there is no disc brighter than its ground.
    pub fn fit(
        &self,
        plane: &Plane<'_>,
        start: DVec2,
        stray_px: f64,
        levels: Option<[f64; 3]>,
        shading: DVec2,
    ) -> Option<FittedDisc> {
        let mut found = self.converge(plane, start, stray_px, levels, shading)?;
        found.doubt();
        Some(found.disc())
    }

    /// As [`MarkerView::fit`]; a disc whose surroundings differ from side to side, or that touches the dome, is then fitted
    /// apart from them.
    pub fn fit_closely(
        &self,
        plane: &Plane<'_>,
        start: DVec2,
        stray_px: f64,
        levels: Option<[f64; 3]>,
        shading: DVec2,
    ) -> Option<FittedDisc> {
        let mut found = self.converge(plane, start, stray_px, levels, shading)?;
        let is_apart =
            (found.unevenness > MAX_UNEVENNESS || found.touches_rim) && found.fit_apart(self, plane);
        if !is_apart {
            found.doubt();
        }
        Some(found.disc())
    }

    fn converge(
        &self,
        plane: &Plane<'_>,
        start: DVec2,
        stray_px: f64,
        levels: Option<[f64; 3]>,
        shading: DVec2,
    ) -> Option<Converged> {
        let mut at = start;
        let mut levels = levels.map(SVector::from);
        for _ in 0..MAX_STEPS {
            if !(is_inside(plane, at) && at.distance(start) <= stray_px) {
                return None;
            }
            // First the levels alone, at the start; then the place with them.
            let known = match levels {
                Some(known) => known,
                None => WindowSums::over(self, plane, at, None, shading)?.solve_levels()?,
            };
            let sums = WindowSums::over(self, plane, at, Some(&known), shading)?;
            let step = sums.solve_all()?;
            let fitted = known + step.fixed_rows::<3>(0);
            levels = Some(fitted);
            let shift = DVec2::new(step[3], step[4]).clamp_length_max(MAX_STEP_PX);
            at += shift;
            if shift.length() < CONVERGED_PX {
                let slope = sums.slope.map(|slope| shading + slope / (known[0] + known[1]).max(MIN_RISE));
                return accept(self, &sums, at, &fitted, slope);
            }
        }
        None
    }
}

fn is_inside(plane: &Plane<'_>, at: DVec2) -> bool {
    let end = |length: usize| length as f64 - BORDER_PX - 1.0;
    at.x > BORDER_PX && at.y > BORDER_PX && at.x < end(plane.width()) && at.y < end(plane.height())
}

/// A converged fit of a disc.
struct Converged {
    centroid_px: DVec2,
    noise_px2: f64,
    /// Variance of the place by what does not look like a disc.
    unlike_px2: f64,
    misfit: f64,
    radius_px: f64,
    /// What it is if it is no good marker.
    reason: MarkState,
    levels: [f64; 3],
    shading: Option<DVec2>,
    /// By what part of the disc's contrast its surroundings differ from octant to octant.
    unevenness: f64,
    touches_rim: bool,
}

impl Converged {
    /// Fits the disc apart from its surroundings, if that goes.
    fn fit_apart(&mut self, view: &MarkerView, plane: &Plane<'_>) -> bool {
        let is_wide = self.radius_px >= MIN_APART_RADIUS_PX;
        let apart = is_wide.then(|| fit_apart(view, plane, self.centroid_px, self.levels)).flatten();
        let Some(apart) = apart.filter(|apart| is_inside(plane, apart.centroid_px)) else { return false };
        self.centroid_px = apart.centroid_px;
        (self.noise_px2, self.unlike_px2) = (apart.noise_px2, apart.unlike_px2);
        self.misfit = apart.misfit;
        true
    }

    /// Surroundings that differ from side to side make the place unsure.
    fn doubt(&mut self) {
        self.unlike_px2 += (MOVED_BY_UNEVENNESS_PX * (self.unevenness - EVEN).max(0.0)).powi(2);
    }

    fn disc(&self) -> FittedDisc {
        let is_faulty = self.unlike_px2.sqrt() > f64::max(MAX_SD_PX, MAX_SD_RADII * self.radius_px);
        FittedDisc {
            centroid_px: self.centroid_px,
            sd_px: (self.noise_px2 + self.unlike_px2).sqrt(),
            noise_sd_px: self.noise_px2.sqrt(),
            misfit: self.misfit,
            radius_px: self.radius_px,
            fault: is_faulty.then_some(self.reason),
            levels: self.levels,
            shading: self.shading,
        }
    }
}

/// A converged fit, if it is a disc's.
fn accept(
    view: &MarkerView,
    sums: &WindowSums,
    at: DVec2,
    levels: &SVector<f64, 3>,
    shading: Option<DVec2>,
) -> Option<Converged> {
    let (noise, rms) = (sums.noise(), sums.rms());
    let rise = levels[1];
    // What is a disc, perhaps beside a dome brighter than it, leaves a small part of that unexplained.
    let contrast = rise.max(0.5 * levels[2].abs());
    let clear = rise > MIN_RISE && rise > MIN_RISE_IN_NOISE * noise;
    if !(clear && rms < MAX_MISFIT * contrast) {
        return None;
    }
    let inverse = sums.inverse()?;
    let noise_px2 = (noise * noise * 0.5 * (inverse[(3, 3)] + inverse[(4, 4)])).max(0.0);
    let unlike_px2 = (sums.variance_between_octants(view, &inverse) - FREE_OF_NOISE * noise_px2).max(0.0);
    let [darkest, brightest] = sums.extremes;
    (at.is_finite() && (noise_px2 + unlike_px2).is_finite()).then_some(Converged {
        centroid_px: at,
        noise_px2,
        unlike_px2,
        misfit: rms / contrast,
        radius_px: view.radius_mm / view.mm_by_px.determinant().abs().sqrt().max(1e-9),
        reason: if -darkest > brightest { MarkState::PartlyHidden } else { MarkState::Glare },
        levels: (*levels).into(),
        shading,
        unevenness: sums.unevenness() / rise,
        touches_rim: sums.touches_rim,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::frame::CameraFrame;
    use crate::track::marks::Candidate;
    use crate::track::options::Channel;
    use glam::DMat2;

    /// A view straight from above: a disc of 5 px, the dome's rim far away.
    fn view() -> MarkerView {
        MarkerView {
            mm_by_px: DMat2::IDENTITY * 0.05,
            place_mm: DVec2::new(30.0, 0.0),
            radius_mm: 0.25,
            rim_mm: 10.0,
            half_px: 9,
            around_px: [[8, 0], [6, 6], [0, 8], [-6, 6], [-8, 0], [-6, -6], [0, -8], [6, -6]],
        }
    }

    /// A disc on its ground; each pixel the mean of 8 x 8 samples.
    fn picture(at: DVec2, radius_px: f64, [ground, disc]: [f64; 2]) -> Vec<u8> {
        picture_on(at, radius_px, disc, |_| ground)
    }

    /// A disc on any ground.
    fn picture_on(at: DVec2, radius_px: f64, disc: f64, ground: impl Fn(DVec2) -> f64) -> Vec<u8> {
        let level = |i: usize| {
            let ground = ground(DVec2::new((i % 48) as f64, (i / 48) as f64));
            let corner = DVec2::new((i % 48) as f64, (i / 48) as f64) - 0.5;
            let inside = |k: usize| {
                let sample = corner + (DVec2::new((k % 8) as f64, (k / 8) as f64) + 0.5) / 8.0;
                sample.distance(at) < radius_px
            };
            let part = (0..64).filter(|k| inside(*k)).count() as f64 / 64.0;
            (ground + (disc - ground) * part).round() as u8
        };
        (0..48 * 40).map(level).collect()
    }

    #[test]
    fn a_disc_is_found_and_fitted_to_hundredths_of_a_pixel() {
        let center = DVec2::new(22.3, 18.7);
        let bytes = picture(center, 5.0, [40.0, 200.0]);
        let frame = CameraFrame::new(48, 40, 1, &bytes).unwrap();
        let plane = Plane::new(&frame, Channel::Luma);
        let mut places = [Candidate::default(); 2];
        assert!(view().candidates(&plane, DVec2::new(20.0, 20.0), 10.0, &mut places) > 0);
        let disc = view().fit(&plane, places[0].at_px, FIT_REACH_PX, None, DVec2::ZERO).unwrap();
        assert!(disc.centroid_px.distance(center) < 0.03, "{}", disc.centroid_px);
        assert!(disc.sd_px > 0.0 && disc.sd_px < 0.05 && disc.misfit < 0.1, "{disc:?}");
    }

    #[test]
    fn what_is_beside_a_disc_moves_it_or_makes_it_unsure() {
        let center = DVec2::new(22.3, 18.7);
        let fits = |ground: &dyn Fn(DVec2) -> f64| {
            let bytes = picture_on(center, 5.0, 200.0, ground);
            let frame = CameraFrame::new(48, 40, 1, &bytes).unwrap();
            let plane = Plane::new(&frame, Channel::Luma);
            let start = center + DVec2::new(0.4, -0.3);
            let plain = view().fit(&plane, start, FIT_REACH_PX, None, DVec2::ZERO).unwrap();
            let close = view().fit_closely(&plane, start, FIT_REACH_PX, None, DVec2::ZERO).unwrap();
            (plain, close)
        };
        let (plain, close) = fits(&|_| 40.0);
        assert_eq!(plain, close);
        // Light that falls off from the right, and a step below.
        let light = |at: DVec2| 40.0 + 100.0 * ((at.x - 30.0) / 5.0).exp().min(1.0);
        let step = |at: DVec2| if at.y > 23.5 { 120.0 } else { 40.0 };
        let worst = [fits(&light), fits(&step)].map(|(plain, close)| {
            let [off, closer] = [plain, close].map(|disc| disc.centroid_px.distance(center));
            assert!(off < 3.0 * plain.sd_px, "{off} {}", plain.sd_px);
            assert!(closer < 0.06 && closer < 3.0 * close.sd_px, "{closer} {}", close.sd_px);
            off
        });
        assert!(worst[0] > 0.1, "{worst:?}");
    }

    #[test]
    fn flat_ground_and_dark_discs_are_no_markers() {
        for [ground, disc] in [[80.0, 80.0], [200.0, 40.0]] {
            let bytes = picture(DVec2::new(22.0, 19.0), 5.0, [ground, disc]);
            let frame = CameraFrame::new(48, 40, 1, &bytes).unwrap();
            let plane = Plane::new(&frame, Channel::Luma);
            let start = DVec2::new(22.0, 19.0);
            assert_eq!(view().fit(&plane, start, FIT_REACH_PX, None, DVec2::ZERO), None);
        }
    }
}
