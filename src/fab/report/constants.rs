//! The constants at a glance on the page.

use glam::DVec3;

use super::subject::ReportSubject;
use crate::html::{Html, html, table};
use crate::numbers::{dimension, significant};
use domecast_runtime::constants::{POSE_AXES, SpringConstants, WRENCH_AXES};
use domecast_springs::STANDARD_GRAVITY_MPS2;

fn list(values: &[f64]) -> String {
    values.iter().map(|v| dimension(*v)).collect::<Vec<_>>().join(", ")
}

/// Camera, white markers, stiffness.
pub(super) fn chapter(subject: &ReportSubject<'_>) -> Html {
    let c = subject.constants;
    let n = dimension;
    let matrix = |m: &[[f64; 3]; 3]| {
        format!("fx {}, fy {}, cx {}, cy {}", n(m[0][0]), n(m[1][1]), n(m[0][2]), n(m[1][2]))
    };
    let rows = [
        ("camera", format!("{}, {} × {} px", c.camera.model, c.camera.width, c.camera.height)),
        ("matrix, px", matrix(&c.camera.matrix)),
        ("distortion", list(&c.camera.distortion)),
        ("undistorted matrix, px", matrix(&c.camera.undistorted_matrix)),
        (
            "mask, undistorted px",
            format!("centre {}, radius {}", list(&c.mask.center_px), n(c.mask.radius_px)),
        ),
    ]
    .map(|(name, value)| vec![name.into(), value.into()]);
    let marker = |marker: &domecast_runtime::constants::WhiteMarker| {
        vec![
            html!("{}", marker.id),
            list(&marker.position_mm).into(),
            marker.apparent_position_mm.map_or_else(|| "–".into(), |p| list(&p)).into(),
            list(&marker.image_px).into(),
        ]
    };
    html!(
        "{}{}{}<p>The whole: <a href=\"../constants/constants.json\"><code>constants/constants.json</code></a>.</p>\n",
        table("Camera", &["", "value"], &rows),
        table(
            "White markers",
            &["id", "painted at, mm", "appears at (plain solvePnP), mm", "in the raw image, px"],
            &c.white_markers.iter().map(marker).collect::<Vec<_>>(),
        ),
        c.springs.as_ref().map_or_else(Html::default, stiffness),
    )
}

fn stiffness(springs: &SpringConstants) -> Html {
    let row = |(axis, row): (&&str, &[f64; 6])| {
        // what rounding leaves beside the diagonal is nothing
        let floor = 1e-12 * row.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        let cell = |v: &f64| if v.abs() <= floor { "0".into() } else { dimension(*v).into() };
        std::iter::once(Html::from(*axis)).chain(row.iter().map(cell)).collect()
    };
    let rows: Vec<Vec<Html>> = WRENCH_AXES.iter().zip(&springs.stiffness).map(row).collect();
    let mut heads = vec![""];
    heads.extend(POSE_AXES);
    let moving = springs.moving.as_ref().map_or_else(Html::default, |moving| {
        html!(
            "<p>The springs carry {} g. A sensor that is turned over reports twice their weight, {} N, as a load, unless \
             <code>domecast track --gravity</code> takes it off.</p>\n",
            dimension(moving.mass_g),
            significant(2.0 * moving.weight_n(DVec3::Z * STANDARD_GRAVITY_MPS2).z)
        )
    });
    let stiffness = table(
        &format!(
            "Stiffness at rest ({}), N, N·mm against mm, rad, about {} mm",
            springs.source,
            list(&springs.at_mm)
        ),
        &heads,
        &rows,
    );
    html!("{}{}", stiffness, moving)
}
