//! Mistakes that turn good centroids into others: each with its name and what takes it back.

use glam::{DVec2, DVec3, Vec2Swizzles};

use super::types::Kind;
use crate::constants::Constants;
use domecast_optics::SensorOptics;

/// A mistake that was made with a table of centroids.
pub(super) struct CentroidMistake<'a> {
    /// What the table looks like, in words.
    pub name: String,
    cure: CentroidCure<'a>,
}

enum CentroidCure<'a> {
    /// Where a centroid really is; `None` where it cannot be.
    Place(Box<dyn Fn(DVec2) -> Option<DVec2> + 'a>),
    /// Which white marker each one really is, by place in the list.
    WhiteOrder(Vec<usize>),
    /// By how much the dots' places in their list are off.
    BlackShift(isize),
}

impl CentroidMistake<'_> {
    /// Kind, place in the list and centroid without the mistake.
    pub fn taken_back(&self, kind: Kind, index: usize, at_px: DVec2) -> Option<(usize, DVec2)> {
        match (&self.cure, kind) {
            (CentroidCure::Place(place), _) => Some((index, place(at_px)?)),
            (CentroidCure::WhiteOrder(order), Kind::White) => Some((*order.get(index)?, at_px)),
            (CentroidCure::BlackShift(by), Kind::Black) => Some((index.checked_add_signed(*by)?, at_px)),
            _ => Some((index, at_px)),
        }
    }
}

/// All orders of so many things, the one as it is first.
pub(super) fn orders(count: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for _ in 0..count {
        all = all
            .into_iter()
            .flat_map(|head: Vec<usize>| {
                let next = (0..count).filter(|k| !head.contains(k)).collect::<Vec<_>>();
                next.into_iter().map(move |k| [head.as_slice(), &[k]].concat())
            })
            .collect();
    }
    all
}

/// An order of the white markers in words; `None` of the one as it is.
pub(super) fn order_in_words(order: &[usize], ids: &[usize]) -> Option<String> {
    let moved: Vec<usize> = (0..order.len()).filter(|k| order[*k] != *k).collect();
    let id = |k: usize| ids.get(k).copied().unwrap_or(k);
    match moved[..] {
        [] => None,
        [a, b] => Some(format!("white markers {} and {} swapped", id(a), id(b))),
        _ => {
            let pairs: Vec<String> =
                moved.iter().map(|k| format!("{} is {}", id(*k), id(order[*k]))).collect();
            Some(format!(
                "white markers in another order, as in a turned or mirrored frame ({})",
                pairs.join(", ")
            ))
        }
    }
}

/// All mistakes that are known, for a sensor.
pub(super) fn centroid_mistakes<'a>(
    constants: &'a Constants,
    optics: &'a SensorOptics,
) -> Vec<CentroidMistake<'a>> {
    let end = DVec2::new(f64::from(constants.camera.width), f64::from(constants.camera.height)) - 1.0;
    let size = end + 1.0;
    let lens = optics.lens();
    let through = move |matrix: [[f64; 3]; 3], p: DVec2| {
        let y = (p.y - matrix[1][2]) / matrix[1][1];
        let x = (p.x - matrix[0][2] - matrix[0][1] * y) / matrix[0][0];
        lens.project(DVec3::new(x, y, 1.0)).ok()
    };
    let mut all = Vec::new();
    let mut place = |name: &str, cure: Box<dyn Fn(DVec2) -> Option<DVec2> + 'a>| {
        all.push(CentroidMistake { name: name.into(), cure: CentroidCure::Place(cure) });
    };
    place("u and v swapped", Box::new(|p| Some(p.yx())));
    place("pixels doubled: centroids of frames of twice the size", Box::new(|p| Some((p + 0.5) * 0.5 - 0.5)));
    place("pixels halved: centroids of frames of half the size", Box::new(|p| Some((p + 0.5) * 2.0 - 0.5)));
    place("frames mirrored left to right", Box::new(move |p| Some(DVec2::new(end.x - p.x, p.y))));
    place(
        "v counted from the bottom, or frames upside down",
        Box::new(move |p| Some(DVec2::new(p.x, end.y - p.y))),
    );
    place("frames turned by 180 degrees", Box::new(move |p| Some(end - p)));
    place("frames turned by 90 degrees", Box::new(move |p| Some(DVec2::new(p.y, end.y - p.x))));
    place("frames turned by 270 degrees", Box::new(move |p| Some(DVec2::new(end.x - p.y, p.x))));
    place("parts of the image's width and height instead of px", Box::new(move |p| Some(p * size - 0.5)));
    place("coordinates from the image's middle", Box::new(move |p| Some(p + 0.5 * end)));
    let of_rays = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    place("rays (x/z, y/z) instead of px", Box::new(move |p| through(of_rays, p)));
    let own = constants.camera.matrix;
    place(
        "centroids of undistorted frames (with the camera's own matrix)",
        Box::new(move |p| through(own, p)),
    );
    let other = constants.camera.undistorted_matrix;
    place(
        "centroids of undistorted frames (camera.undistorted_matrix)",
        Box::new(move |p| through(other, p)),
    );
    let ids: Vec<usize> = constants.white_markers.iter().map(|marker| marker.id).collect();
    if ids.len() <= 5 {
        let named =
            orders(ids.len()).into_iter().filter_map(|order| Some((order_in_words(&order, &ids)?, order)));
        all.extend(
            named.map(|(name, order)| CentroidMistake { name, cure: CentroidCure::WhiteOrder(order) }),
        );
    }
    for (by, name) in [(-1, "black dots numbered one too high"), (1, "black dots numbered one too low")] {
        all.push(CentroidMistake { name: name.into(), cure: CentroidCure::BlackShift(by) });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_have_words() {
        let all = orders(4);
        assert_eq!(all.len(), 24);
        assert_eq!(order_in_words(&all[0], &[0, 1, 2, 3]), None);
        assert_eq!(order_in_words(&[0, 3, 2, 1], &[5, 6, 7, 8]).unwrap(), "white markers 6 and 8 swapped");
        assert!(order_in_words(&[1, 2, 3, 0], &[0, 1, 2, 3]).unwrap().contains("0 is 1, 1 is 2"));
    }
}
