use glam::DVec2;

use super::*;

/// A frame with shaded ground and discs (place, radius, value), each pixel the mean of 16 x 16 samples.
fn picture(width: usize, height: usize, ground: impl Fn(DVec2) -> f64, discs: &[(DVec2, f64, f64)]) -> Gray {
    let mut values = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let mut sum = 0.0;
            for k in 0..256 {
                let step = DVec2::new(f64::from(k % 16), f64::from(k / 16)) / 16.0 - DVec2::splat(0.46875);
                let at = DVec2::new(x as f64, y as f64) + step;
                let disc = discs.iter().find(|(place, radius, _)| at.distance(*place) < *radius);
                sum += disc.map_or_else(|| ground(at), |(_, _, value)| *value);
            }
            values.push((sum / 256.0) as f32);
        }
    }
    Gray::new(width, height, values).unwrap()
}

fn marks(frame: &Gray, side: BlobSide, reach: usize) -> Vec<Blob> {
    let levels = local_levels(frame, reach);
    blobs(frame, side, |i| (levels.contrast[i] > 0.2).then_some(levels.middle[i]))
}

#[test]
fn discs_are_found_to_hundredths_under_shading_and_blur() {
    let discs = [
        (DVec2::new(14.3, 12.8), 3.6, 0.1),
        (DVec2::new(30.72, 13.1), 3.1, 0.12),
        (DVec2::new(22.05, 29.4), 4.2, 0.08),
    ];
    let frame = picture(48, 44, |p| 0.4 + 0.004 * p.x + 0.002 * p.y, &discs);
    for frame in [frame.clone(), frame.blurred(0.8)] {
        let found = marks(&frame, BlobSide::Dark, 12);
        assert_eq!(found.len(), 3);
        let taken = |x: u32, y: u32| found.iter().any(|b| b.pixels.contains(&[x, y]));
        for ((place, radius, _), blob) in discs.iter().zip([&found[0], &found[1], &found[2]]) {
            let blob = found
                .iter()
                .min_by(|a, b| a.middle_px.distance(*place).total_cmp(&b.middle_px.distance(*place)))
                .unwrap_or(blob);
            let spot = centroid(&frame, blob, taken).unwrap();
            assert!(spot.at_px.distance(*place) < 0.02, "{} {place}", spot.at_px);
            let area = std::f64::consts::PI * radius * radius;
            assert!((spot.area_px / area - 1.0).abs() < 0.25, "{} {area}", spot.area_px);
            assert!(spot.contrast < -0.2 && blob.fullness() > 0.9, "{} {}", spot.contrast, blob.fullness());
        }
    }
}

// A bright disc two pixels beside the edge of something half as bright.
#[test]
fn an_edge_beside_a_disc_moves_it_little() {
    let place = DVec2::new(20.3, 18.7);
    let frame = picture(40, 40, |p| if p.x + 0.3 * p.y < 16.5 { 0.5 } else { 0.2 }, &[(place, 4.5, 0.95)])
        .blurred(0.7);
    let found: Vec<Blob> =
        marks(&frame, BlobSide::Bright, 12).into_iter().filter(|b| b.fullness() > 0.9).collect();
    let spot = found.iter().filter_map(|b| centroid(&frame, b, |_, _| false));
    let nearest = spot.map(|s| s.at_px.distance(place)).fold(f64::INFINITY, f64::min);
    assert!(nearest < 0.1, "{nearest}");
}

#[test]
fn levels_follow_the_extremes_of_a_square() {
    let mut state = 7_u32;
    let values: Vec<f32> = (0..23 * 17)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        })
        .collect();
    let frame = Gray::new(23, 17, values).unwrap();
    for reach in [0_usize, 1, 3, 40] {
        let levels = local_levels(&frame, reach);
        for (x, y) in [(0_usize, 0_usize), (5, 9), (22, 16), (11, 0)] {
            let around = |v: usize, end: usize| v.saturating_sub(reach)..(v + reach + 1).min(end);
            let all = around(y, 17).flat_map(|b| around(x, 23).map(move |a| (a, b)));
            let all: Vec<f32> = all.map(|(a, b)| frame.at(a as isize, b as isize)).collect();
            let (low, high) =
                all.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
            assert_eq!(levels.contrast[y * 23 + x], high - low);
            assert_eq!(levels.middle[y * 23 + x], 0.5 * (low + high));
        }
    }
}

#[test]
fn blobs_join_over_corners_and_know_the_border() {
    let rows = ["#...", ".#..", "...#", "...#"];
    let values = rows.iter().flat_map(|r| r.chars()).map(|c| if c == '#' { 1.0 } else { 0.0 }).collect();
    let frame = Gray::new(4, 4, values).unwrap();
    let found = blobs(&frame, BlobSide::Bright, |_| Some(0.5));
    assert_eq!(found.len(), 2);
    assert_eq!(found[0].pixels, [[0, 0], [1, 1]]);
    assert_eq!(found[1].corners, [[3, 2], [3, 3]]);
    assert!(found[0].touches_border(&frame));
    assert!(centroid(&frame, &found[0], |_, _| false).is_none());
    assert!(blobs(&frame, BlobSide::Bright, |_| None).is_empty());
}

#[test]
fn png_files_are_read_and_refused() {
    let write = |color: png::ColorType, depth: png::BitDepth, data: &[u8]| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        bytes
    };
    let grey = write(png::ColorType::Grayscale, png::BitDepth::Eight, &[51, 255]);
    assert_eq!(Gray::from_png(&grey).unwrap().values(), [0.2, 1.0]);
    let color = write(png::ColorType::Rgb, png::BitDepth::Eight, &[1, 51, 2, 3, 255, 4]);
    assert_eq!(Gray::from_png(&color).unwrap().values(), [0.2, 1.0]);
    let wide = write(png::ColorType::Grayscale, png::BitDepth::Sixteen, &[0x33, 0x33, 0xff, 0xff]);
    assert_eq!(Gray::from_png(&wide).unwrap().values(), [0.2, 1.0]);
    assert!(matches!(Gray::from_png(b"no picture"), Err(FrameError::NotPng(_))));
    assert!(matches!(Gray::from_png(&grey[..grey.len() - 20]), Err(FrameError::NotPng(_))));
    assert!(matches!(Gray::new(0, 3, vec![]), Err(FrameError::Size { .. })));
    assert!(matches!(Gray::new(2, 2, vec![0.0]), Err(FrameError::Count { values: 1 })));
}
