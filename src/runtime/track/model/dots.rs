//! The dots of the constants, made ready to be looked for.

use glam::{DVec2, DVec3};

use crate::constants::{BlackDot, Constants, KeyImageConstants};
use crate::track::error::TrackError;
use crate::track::marks::{MAX_RADIUS_PX, SpotOutline};
use domecast_optics::SensorOptics;
use domecast_optics::pose::outline_centroid_offset;

/// Dots that constants may have.
const MAX_DOTS: usize = 20_000;

/// A dot of the constants.
#[derive(Debug, Clone)]
pub(in crate::track) struct DotModel {
    pub id: u32,
    /// Its centre on the undeformed dome, sensor frame, mm.
    pub surface_mm: DVec3,
    /// Half of its diameter, mm.
    radius_mm: f64,
    /// Its image at rest.
    pub outline: SpotOutline,
    /// Numbers of its neighbours in the list of dots.
    pub neighbors: Vec<usize>,
    /// Distance to the nearest neighbour in the image at rest, px.
    pub spacing_px: f64,
    /// Image of its centre at rest, px.
    pub rest_px: DVec2,
}

/// Area, largest radius and spread of an outline of eight points about its centroid.
fn outline_of(center: DVec2, outline: &[DVec2; 8]) -> SpotOutline {
    let (mut area, mut spread, mut radius) = (0.0, 0.0, 0.0_f64);
    let mut apart = DVec2::ZERO;
    for (i, p) in outline.iter().enumerate() {
        let (a, b) = (*p - center, outline[(i + 1) % 8] - center);
        let swept = 0.5 * a.perp_dot(b);
        area += swept;
        // Second moment of the triangle (0, a, b) about its corner: area (a.a + a.b + b.b) / 6.
        spread += swept * (a.dot(a) + a.dot(b) + b.dot(b)) / 6.0;
        // The same of the squares along x less those along y, and of twice their product.
        let double = |p: DVec2, q: DVec2| DVec2::new(p.x * q.x - p.y * q.y, p.x * q.y + p.y * q.x);
        apart += (double(a, a) + double(a, b) + double(b, b)) * (swept / 6.0);
        radius = radius.max(a.length());
    }
    // An octagon in a circle has 0.9003 of its area and 0.854 of its mean square distance.
    let octagon = 0.900_316;
    let (area_px, spread_px2) = (area.abs() / octagon, (spread / area).abs() / 0.853_6);
    let elongation = if spread == 0.0 { DVec2::ZERO } else { apart / spread };
    SpotOutline { radius_px: radius, area_px, spread_px2, elongation }
}

impl DotModel {
    /// Centroid of its image less the image of its centre, at the pose of the optics; with its outline's shape.
    pub fn image_at(&self, optics: &SensorOptics, center_px: DVec2) -> Option<(DVec2, SpotOutline)> {
        let at = self.surface_mm;
        let east = DVec3::new(-at.y, at.x, 0.0).try_normalize().unwrap_or(DVec3::X);
        let dome = optics.dome();
        let north = dome.outward_mm(at).cross(east).normalize_or_zero();
        let mut outline = [DVec2::ZERO; 8];
        let mut next = 0;
        let offset = outline_centroid_offset(center_px, |cos, sin| {
            let there = at + (east * cos + north * sin) * self.radius_mm;
            let pixel = optics.project(dome.onto(there)).ok()?;
            outline[next] = pixel;
            next += 1;
            Some(pixel)
        })?;
        Some((offset, outline_of(center_px + offset, &outline)))
    }
}

/// The dot that a symmetric pattern leaves out, and the dots where a turned or mirrored picture shows the gap.
#[derive(Debug, Clone)]
pub(in crate::track) struct KeyModel {
    /// The dot as it would be.
    pub dot: DotModel,
    /// Turn of the picture from image x towards image y, rad; whether it was mirrored before; number in the list of
    /// dots.
    pub images: Vec<(f64, bool, usize)>,
}

/// The key of constants that have one.
pub(super) fn key_of(
    constants: &Constants,
    optics: &SensorOptics,
    dots: &[DotModel],
) -> Result<Option<KeyModel>, TrackError> {
    let Some(key) = &constants.key else { return Ok(None) };
    let find = |id: usize, field: &str| {
        let found = dots.iter().position(|dot| dot.id as usize == id);
        found.ok_or_else(|| TrackError::at(field, format!("names dot {id}, which is not there")))
    };
    let surface_mm = DVec3::from_array(key.surface_mm);
    let Ok(rest_px) = optics.project(surface_mm) else {
        return Err(TrackError::at("key.surface_mm", "is not seen at rest through these lens and layers"));
    };
    let neighbors =
        key.neighbors.iter().map(|id| find(*id, "key.neighbors")).collect::<Result<Vec<_>, _>>()?;
    let near = neighbors.iter().map(|n| dots[*n].rest_px.distance(rest_px));
    let spacing_px = near.fold(f64::INFINITY, f64::min);
    let mut dot = DotModel {
        id: u32::MAX,
        surface_mm,
        radius_mm: 0.5 * key.diameter_mm,
        outline: SpotOutline::default(),
        neighbors,
        spacing_px,
        rest_px,
    };
    let outline = dot.image_at(optics, rest_px).map(|(_, outline)| outline);
    let fits = |outline: &SpotOutline| outline.radius_px > 0.0 && outline.radius_px <= MAX_RADIUS_PX;
    let Some(outline) = outline.filter(fits).filter(|_| spacing_px.is_finite() && spacing_px > 0.0) else {
        return Err(TrackError::at("key", "has no neighbours, or an image that is no dot's"));
    };
    dot.outline = outline;
    let image = |image: &KeyImageConstants| {
        let turned_rad = image.turned_deg.to_radians();
        if !turned_rad.is_finite() {
            return Err(TrackError::at("key.images", "have a turn that is no number"));
        }
        Ok((turned_rad, image.mirrored, find(image.dot, "key.images")?))
    };
    let images = key.images.iter().map(image).collect::<Result<Vec<_>, _>>()?;
    Ok(Some(KeyModel { dot, images }))
}

pub(super) fn dots_of(constants: &Constants, optics: &SensorOptics) -> Result<Vec<DotModel>, TrackError> {
    let given = &constants.black_dots;
    let fault = |index: usize, part: &str, problem: String| {
        Err(TrackError::at(format!("black_dots[{index}]{part}"), problem))
    };
    if given.len() > MAX_DOTS {
        return Err(TrackError::at("black_dots", format!("are more than {MAX_DOTS}")));
    }
    let mut by_id: Vec<(usize, usize)> = given.iter().enumerate().map(|(i, d)| (d.id, i)).collect();
    by_id.sort_unstable();
    let mut dots: Vec<DotModel> = Vec::with_capacity(given.len());
    for (index, dot) in given.iter().enumerate() {
        let surface_mm = DVec3::from_array(dot.surface_mm);
        let radius_mm = 0.5 * dot.diameter_mm;
        if by_id.windows(2).any(|w| w[0].0 == w[1].0 && w[0].0 == dot.id) || dot.id > u32::MAX as usize {
            return fault(index, ".id", format!("{} is taken, or too large", dot.id));
        }
        if !(radius_mm > 0.0 && radius_mm < optics.dome_radius_mm()) {
            return fault(index, ".diameter_mm", format!("{} is no dot's", dot.diameter_mm));
        }
        let Ok(center_px) = optics.project(surface_mm) else {
            return fault(index, ".surface_mm", "is not seen at rest through these lens and layers".into());
        };
        let mut model = DotModel {
            id: dot.id as u32,
            surface_mm,
            radius_mm,
            outline: SpotOutline::default(),
            neighbors: neighbors_of(dot, index, &by_id)?,
            spacing_px: f64::INFINITY,
            rest_px: center_px,
        };
        match model.image_at(optics, center_px) {
            Some((_, outline)) if outline.radius_px > 0.0 && outline.radius_px <= MAX_RADIUS_PX => {
                model.outline = outline
            }
            _ => {
                let problem =
                    format!("makes an image that is not seen whole or wider than {MAX_RADIUS_PX} px");
                return fault(index, ".diameter_mm", problem);
            }
        }
        dots.push(model);
    }
    let places: Vec<DVec2> = dots.iter().map(|d| d.rest_px).collect();
    for index in 0..dots.len() {
        let near = dots[index].neighbors.iter().map(|n| places[*n].distance(places[index]));
        let nearest = near.fold(f64::INFINITY, f64::min);
        // A dot alone may be looked for as far as a few of its radii.
        let alone = 6.0 * dots[index].outline.radius_px;
        dots[index].spacing_px = if nearest.is_finite() { nearest.max(1.0) } else { alone };
    }
    Ok(dots)
}

fn neighbors_of(dot: &BlackDot, index: usize, by_id: &[(usize, usize)]) -> Result<Vec<usize>, TrackError> {
    let find = |id: &usize| by_id.binary_search_by_key(id, |(id, _)| *id).ok().map(|at| by_id[at].1);
    let mut found = Vec::with_capacity(dot.neighbors.len());
    for id in &dot.neighbors {
        match find(id) {
            Some(other) if other != index => found.push(other),
            _ => {
                let field = format!("black_dots[{index}].neighbors");
                return Err(TrackError::at(field, format!("names dot {id}, which is not another dot")));
            }
        }
    }
    Ok(found)
}

#[cfg(test)]
impl DotModel {
    /// Dots of a square lattice of so many columns and rows in the image, each with its four neighbours.
    pub fn lattice(columns: usize, rows: usize, spacing_px: f64, outline: SpotOutline) -> Vec<Self> {
        let neighbors = |x: usize, y: usize| {
            let left = (x > 0).then(|| y * columns + x - 1);
            let right = (x + 1 < columns).then(|| y * columns + x + 1);
            let above = (y > 0).then(|| (y - 1) * columns + x);
            let below = (y + 1 < rows).then(|| (y + 1) * columns + x);
            [left, right, above, below].into_iter().flatten().collect()
        };
        let dot = |index: usize| Self {
            id: index as u32,
            surface_mm: DVec3::ZERO,
            radius_mm: 0.3,
            outline,
            neighbors: neighbors(index % columns, index / columns),
            spacing_px,
            rest_px: DVec2::new((index % columns) as f64, (index / columns) as f64) * spacing_px,
        };
        (0..columns * rows).map(dot).collect()
    }
}
