use glam::DVec2;
use std::str::FromStr;
use svg::parser::Event;

use super::*;
use domecast_design;
use domecast_design::layout::Layout;

fn thumb24() -> (LayoutSpec, Layout) {
    let design = domecast_design::Design::from_str(include_str!("../../../designs/thumb24.json")).unwrap();
    let spec = LayoutSpec::of_design(&design).unwrap();
    let layout = Layout::new(&spec).unwrap();
    (spec, layout)
}

#[test]
fn svg_read_again_maps_back_to_the_dome() {
    let (_, layout) = thumb24();
    let drawing = layout.film(0).drawing().unwrap();
    let text = String::from_utf8(to_svg(&drawing)).unwrap();
    let mut layers = Vec::new();
    let mut dots = 0;
    let mut size = None;
    for event in svg::read(&text).unwrap() {
        let Event::Tag(name, _, attributes) = event else { continue };
        let get = |key: &str| attributes.get(key).map(|value| value.to_string());
        if name == "svg" && size.is_none() {
            size = Some((get("width").unwrap(), get("height").unwrap(), get("viewBox").unwrap()));
            assert_eq!(
                get("data-design-sha256").unwrap(),
                crate::hash::sha256_hex(layout.origin().text.as_bytes())
            );
        }
        if get("inkscape:groupmode").as_deref() == Some("layer") {
            layers.push(get("inkscape:label").unwrap());
        }
        let Some(id) = get("data-id") else { continue };
        let dot = &layout.dots[id.parse::<usize>().unwrap()];
        assert_eq!(get("id").unwrap(), format!("dot-{id}"));
        let number = |key: &str| get(key).unwrap().parse::<f64>().unwrap();
        let plate_mm = DVec2::new(number("data-x-mm"), number("data-y-mm"));
        let on_dome = layout.transfer.dome_from_plate(plate_mm).unwrap();
        assert!((on_dome - dot.surface_mm).length() < 1e-12);
        // The drawn outline surrounds the centre, with y turned over.
        let data = get("d").unwrap();
        let coordinates: Vec<f64> = data
            .split(['M', 'C', 'Z', ',', ' '])
            .filter(|t| !t.is_empty())
            .map(|t| t.parse().unwrap())
            .collect();
        let corners = coordinates.chunks(2).map(|c| DVec2::new(c[0], -c[1]));
        let middle = corners.clone().sum::<DVec2>() / corners.len() as f64;
        assert!(middle.distance(plate_mm) < 0.1, "{middle} {plate_mm}");
        dots += 1;
    }
    assert_eq!(dots, layout.dots.len());
    assert_eq!(layers, ["dots", "registration", "notes"]);
    let (width, height, view) = size.unwrap();
    let view: Vec<f64> = view.split(' ').map(|t| t.parse().unwrap()).collect();
    assert_eq!(width, format!("{}mm", view[2]));
    assert_eq!(height, format!("{}mm", view[3]));
}

#[test]
fn a_film_has_the_scale_of_its_own_design() {
    let text = include_str!("../../../designs/thumb24.json");
    let other = text.replace("\"pad_over_image\": 1.3", "\"pad_over_image\": 1.5");
    assert_ne!(text, other);
    let widths = [text, &other].map(|text| {
        let layout = domecast_design::Design::from_str(text).unwrap().layout().unwrap();
        let drawing = layout.film(0).drawing().unwrap();
        let footprint = drawing.facts.iter().find(|(name, _)| name == "pad-footprint-radius-mm").unwrap();
        footprint.1.parse::<f64>().unwrap()
    });
    assert!((widths[1] / widths[0] - 1.5 / 1.3).abs() < 1e-12, "{widths:?}");
}

#[test]
fn a_pass_that_is_not_there_has_no_film() {
    let (_, layout) = thumb24();
    let error = layout.film(1).to_svg().unwrap_err();
    assert_eq!(error.to_string(), "film 1: the layout has 1 print passes; allowed: 0 to 0");
    assert!(layout.target_film().to_svg().is_ok());
}

#[test]
fn registration_stays_off_the_pad() {
    let (_, layout) = thumb24();
    let drawing = layout.film(0).drawing().unwrap();
    let footprint_mm = layout.print().pad_over_image
        * film::picture_radius_mm(layout.dots.iter().map(|dot| &dot.plate_outline));
    for layer in &drawing.layers[1..] {
        for item in &layer.items {
            match item {
                drawing::Item::Path(shape) => {
                    let mut corners = vec![shape.path.start()];
                    for segment in shape.path.segments() {
                        match segment {
                            drawing::Segment::Line(to) => corners.push(*to),
                            drawing::Segment::Cubic(..) => panic!("straight lines only"),
                        }
                    }
                    for pair in corners.windows(2) {
                        for k in 0..=20 {
                            let at = pair[0].lerp(pair[1], f64::from(k) / 20.0);
                            assert!(at.length() > footprint_mm + 0.9, "{at}");
                            let (low, high) = drawing.page_mm;
                            assert!(at.cmpge(low).all() && at.cmple(high).all());
                        }
                    }
                }
                drawing::Item::Text(text) => assert!(text.at.y < -footprint_mm - 0.9),
            }
        }
    }
}

#[test]
fn camera_view_shows_each_dot_where_it_is() {
    let (spec, layout) = thumb24();
    let png = camera_view(&spec, &layout).unwrap();
    let picture = tiny_skia::Pixmap::decode_png(&png).unwrap();
    assert_eq!((picture.width(), picture.height()), (640, 480));
    let dark = |x: u32, y: u32| f64::from(205u8.saturating_sub(picture.pixel(x, y).unwrap().green())) / 195.0;
    for dot in &layout.dots {
        let (mut weight, mut moment) = (0.0, DVec2::ZERO);
        let middle = dot.image_px.round();
        for y in middle.y as u32 - 6..=middle.y as u32 + 6 {
            for x in middle.x as u32 - 6..=middle.x as u32 + 6 {
                weight += dark(x, y);
                moment += dark(x, y) * DVec2::new(f64::from(x), f64::from(y));
            }
        }
        assert!((moment / weight).distance(dot.image_px) < 0.1, "{} {}", moment / weight, dot.image_px);
        let area = dot.image_outline.signed_area().abs();
        assert!((weight / area - 1.0).abs() < 0.05, "{weight} {area}");
    }
    for marker in &spec.white_markers {
        let at = spec.optics.project(marker.position_mm).unwrap().round();
        assert_eq!(picture.pixel(at.x as u32, at.y as u32).unwrap().green(), 255);
    }
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    let make = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (spec, layout) = thumb24();
            files(&spec, &layout).unwrap()
        })
    };
    assert_eq!(make(1), make(4));
}

#[test]
#[ignore = "writes files to look at; set DOMECAST_LOOK to a folder"]
fn look() {
    let folder = std::path::PathBuf::from(std::env::var("DOMECAST_LOOK").unwrap());
    let (spec, layout) = thumb24();
    for file in files(&spec, &layout).unwrap() {
        let path = folder.join(&file.path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, file.bytes).unwrap();
    }
}
