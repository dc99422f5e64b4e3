//! Where a colour is missing: connected places of the dome.

use serde::Serialize;

use domecast_sim::light::illumination::Illumination;

/// Names of the colours, in their order.
pub const COLORS: [&str; 3] = ["red", "green", "blue"];

/// Connected places without enough of one colour.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Crescent {
    /// The colour that is missing.
    pub color: &'static str,
    /// Part of the dome's area, of all of it.
    pub share_of_dome: f64,
    /// Mean azimuth of its places (direction of the sum of their unit vectors), degrees.
    pub azimuth_deg: f64,
    /// Smallest polar angle of its places, degrees.
    pub min_polar_deg: f64,
    /// Largest polar angle of its places, degrees.
    pub max_polar_deg: f64,
}

/// The crescents, the largest first; `lacking` says of each place which colours are missing.
pub fn crescents(light: &Illumination, lacking: &[[bool; 3]]) -> Vec<Crescent> {
    let mut found = Vec::new();
    for (color, name) in COLORS.into_iter().enumerate() {
        let mut left: Vec<bool> = lacking.iter().map(|lacks| lacks[color]).collect();
        for start in 0..left.len() {
            let members = connected(light, &mut left, start);
            if !members.is_empty() {
                found.push(crescent(light, name, &members));
            }
        }
    }
    found.sort_by(|a, b| b.share_of_dome.total_cmp(&a.share_of_dome));
    found
}

/// Takes what hangs together with a place out of `left`.
fn connected(light: &Illumination, left: &mut [bool], start: usize) -> Vec<usize> {
    let (rings, around) = (light.grid.rings, light.grid.places);
    let (mut members, mut open) = (Vec::new(), vec![start]);
    while let Some(index) = open.pop() {
        let Some(is_left) = left.get_mut(index).filter(|is_left| **is_left) else { continue };
        *is_left = false;
        members.push(index);
        let (ring, place) = (index / around, index % around);
        open.extend([ring * around + (place + 1) % around, ring * around + (place + around - 1) % around]);
        if ring > 0 {
            open.push(index - around);
        }
        if ring + 1 < rings {
            open.push(index + around);
        }
    }
    members
}

fn crescent(light: &Illumination, color: &'static str, members: &[usize]) -> Crescent {
    let (mut x, mut y, mut min_polar_deg, mut max_polar_deg) = (0.0, 0.0, f64::INFINITY, 0.0_f64);
    for place in members.iter().filter_map(|index| light.places.get(*index)) {
        let (sine, cosine) = place.azimuth_deg.to_radians().sin_cos();
        (x, y) = (x + cosine, y + sine);
        min_polar_deg = min_polar_deg.min(place.polar_deg);
        max_polar_deg = max_polar_deg.max(place.polar_deg);
    }
    Crescent {
        color,
        share_of_dome: members.len() as f64 / light.grid.count() as f64,
        azimuth_deg: y.atan2(x).to_degrees().rem_euclid(360.0),
        min_polar_deg,
        max_polar_deg,
    }
}
