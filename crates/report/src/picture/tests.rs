use glam::DVec3;
use job::{Stand, View};
use radiosity::{IndexChoice, Scene, SceneSpec};

use super::light::{BACKGROUND, BRIGHT, Contrast, SHINING, SHOULDER, Shades, encode, exposure, rank, tone};
use super::*;
use crate::scenes::{cornell, cube, quad, radiosities};

/// The shade at a place of a picture, both coordinates in 0 … 1 from the upper left.
fn shade(picture: &Picture, x: f64, y: f64) -> u8 {
    let column = (x * f64::from(picture.width)) as usize;
    let row = (y * f64::from(picture.height)) as usize;
    picture.pixels[row * picture.width as usize + column]
}

fn cornell_picture(index: IndexChoice) -> Picture {
    let scene = Scene::build(&cornell(), index).unwrap();
    Picture::render(&scene, &radiosities(&scene))
}

#[test]
fn the_cornell_box_looks_like_itself() {
    let picture = cornell_picture(IndexChoice::Auto);
    assert_eq!((picture.width, picture.height), (800, 800));
    assert_eq!(shade(&picture, 0.5, 0.15), 255, "the lamp is white");
    let background = (encode(BACKGROUND) * 255.0).round() as u8;
    for (x, y) in [(0.01, 0.01), (0.99, 0.01), (0.01, 0.99), (0.99, 0.99)] {
        assert_eq!(shade(&picture, x, y), background);
    }
    // From −z, x grows to the left.
    let (light, dark) = (shade(&picture, 0.1, 0.4), shade(&picture, 0.9, 0.4));
    assert!(light > dark + 60 && light < 255 && dark > 0, "{light} {dark}");
    // The short block stands on the left, its top lit and its front in shadow.
    let (top, front) = (shade(&picture, 0.34, 0.66), shade(&picture, 0.27, 0.8));
    assert!(top > front + 100, "{top} {front}");
}

/// A slat of a third of a pixel, which most middles of pixels miss, is seen along all of its length.
#[test]
fn what_is_thinner_than_a_pixel_has_no_gaps() {
    let wall = quad("wall", [[-2., 0., -1.], [2., 0., -1.], [-2., 0., 1.]], [1, 1], 0.5);
    let mut slat = quad("slat", [[-1.5, -0.1, -0.02], [1.5, -0.1, 0.03], [-1.5, -0.1, -0.013]], [1, 1], 0.5);
    slat.emittance = 1.0.into();
    let scene = Scene::build(&SceneSpec::new(vec![wall, slat]), IndexChoice::Auto).unwrap();
    let stand = Stand { eye: DVec3::new(0.0, -3.0, 0.0), look_at: DVec3::ZERO, up: None, fov: 40.0 };
    let view = View { stand: Some(stand), size: Some([200, 100]), exposure: Some(0.5), ..View::default() };
    let picture = Photo::take((&scene, 0), &[0.1, 1.0], None, &view, false).picture;
    for column in 40..160 {
        let shades = picture.pixels.iter().skip(column).step_by(200);
        let (least, most) = (shades.clone().min().unwrap(), shades.max().unwrap());
        assert!(most - least > 10, "column {column}: {least} {most}");
    }
}

#[test]
fn index_and_repetition_change_no_pixel() {
    let picture = cornell_picture(IndexChoice::Flat);
    assert_eq!(picture, cornell_picture(IndexChoice::Flat));
    assert_eq!(picture, cornell_picture(IndexChoice::Tree));
}

#[test]
fn a_patch_is_flat_and_its_edge_is_smooth() {
    let scene = cube();
    let mut radiosity = vec![1.0; scene.faces().len()];
    for (patch, radiosity) in scene.faces().iter().zip(&mut radiosity) {
        if scene.surface_name(patch.surface) == "left" {
            *radiosity = 0.25;
        }
    }
    let picture = Picture::render(&scene, &radiosity);
    let shade_of = |light: f64| (encode(light) * 255.0).round() as u8;
    let bright = BRIGHT[0];
    let (full, quarter) = (shade_of(tone([bright; 3])[0]), shade_of(0.25 * bright));
    let count = |holds: &dyn Fn(u8) -> bool| picture.pixels.iter().filter(|&&p| holds(p)).count();
    assert!(count(&|p| p == full) > 300_000);
    assert!(count(&|p| p == quarter) > 60_000);
    // The slanting edges between left wall, floor and ceiling.
    assert!(count(&|p| p > quarter && p < full) > 300);
}

#[test]
fn a_scene_of_lamps_alone_is_exposed_for_them() {
    let mut dim = quad("dim", [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]], [1, 1], 0.0);
    let mut bright = quad("bright", [[1., 0., 0.], [2., 0., 0.], [1., 1., 0.]], [1, 1], 0.0);
    (dim.emittance, bright.emittance) = (1e-9.into(), 2e-9.into());
    let spec = SceneSpec::new(vec![dim, bright]);
    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
    let picture = Picture::render(&scene, &[1e-9, 2e-9]);
    let shade_of = |light: f64| (encode(light) * 255.0).round() as u8;
    for light in [BRIGHT[0], 0.5 * BRIGHT[0]] {
        assert!(picture.pixels.contains(&shade_of(tone([light; 3])[0])));
    }
}

#[test]
fn values_are_radiosities_and_an_exposure_is_what_a_job_says() {
    let scene = cube();
    let radiosity = vec![3.0; scene.faces().len()];
    let view = View { size: Some([120, 90]), exposure: Some(0.1), ..View::default() };
    let photo = Photo::take((&scene, 0), &radiosity, None, &view, true);
    assert_eq!((photo.shot.size, photo.shot.exposure), ([120, 90], [0.1; 3]));
    assert!((photo.shot.white[0] - 10.0 * SHINING).abs() < 1e-12);
    let (shown, radiance) = ((encode(0.3) * 255.0).round() as u8, 3.0 / std::f32::consts::PI);
    let mut whole = 0;
    for (pixel, [red, green, blue]) in photo.picture.pixels.iter().zip(&photo.values.unwrap().values) {
        assert!(red == green && red == blue && (0.0..radiance + 1e-6).contains(red), "{red}");
        if (red - radiance).abs() < 1e-6 {
            whole += 1;
            assert_eq!(*pixel, shown);
        }
    }
    assert!(whole > 120 * 90 / 2 && whole < 120 * 90, "{whole}");
}

#[test]
fn exposure_ignores_the_brightest_few() {
    let of = |values: &[f64]| rank(values, 0.95);
    assert_eq!(of(&[&[1e6, 0.0], &[1.0; 99][..]].concat()), Some(1.0));
    assert_eq!(of(&[&[2.0, 3.0], &[1.0; 18][..]].concat()), Some(3.0));
    assert_eq!(of(&[&[2.0, 3.0], &[1.0; 19][..]].concat()), Some(2.0));
    assert_eq!((of(&[3.0]), of(&[0.0; 2])), (Some(3.0), None));
}

/// A dim room is lit up, one with a bright wall is not burnt out, and lamps count where nothing else is in sight.
#[test]
fn exposure_is_by_the_middle_pixel_within_what_the_brightest_allow() {
    let scene = cube();
    let of =
        |reflecting: &[f64], emitting: &[f64]| exposure(&scene, &[reflecting.to_vec(), emitting.to_vec()])[0];
    let even = of(&[2.0; 100], &[90.0]);
    assert!((even - BRIGHT[0] / 2.0).abs() < 1e-12, "{even}");
    let uneven = of(&[vec![0.01; 80], vec![1.0; 20]].concat(), &[]);
    assert!((uneven - BRIGHT[1]).abs() < 1e-12, "{uneven}");
    assert!((of(&[], &[5.0]) - BRIGHT[0] / 5.0).abs() < 1e-12);
}

/// White things in even light are distinguished; what differs as much as it is to, and what is even, stays as it is.
#[test]
fn contrast_is_raised_where_there_is_little() {
    let of = |dark: f64| Contrast::of(&[vec![dark; 50], vec![0.5; 50]].concat());
    let [r, g, b] = of(0.4).bend([0.4, 0.2, 0.1]);
    assert!(
        (r - 0.5 * 0.8_f64.powi(3)).abs() < 1e-12
            && (r - 2.0 * g).abs() < 1e-12
            && (r - 4.0 * b).abs() < 1e-12
    );
    assert!((of(0.25).bend([0.25; 3])[0] - 0.5 / 3.0).abs() < 1e-12);
    for light in [0.0, 0.1, 0.4, 0.5, 2.0] {
        assert_eq!([of(0.1), of(0.5)].map(|curve| curve.bend([light; 3])), [[light; 3]; 2]);
        assert!(light < 0.5 || of(0.4).bend([light; 3]) == [light; 3]);
    }
}

#[test]
fn tones_go_on_smoothly_from_what_is_shown_as_it_is_to_white() {
    assert_eq!(tone([SHOULDER, 0.1, 0.2]), [SHOULDER, 0.1, 0.2]);
    assert_eq!([SHINING, 10.0 * SHINING].map(|peak| tone([peak, 0.0, 0.0])), [[1.0; 3]; 2]);
    let steps: Vec<f64> = (0..=6000).map(|k| tone([f64::from(k) * 1e-3; 3])[0]).collect();
    assert!(steps.windows(2).all(|pair| pair[0] < pair[1] && pair[1] - pair[0] <= 1.0001e-3));
    let above = tone([SHOULDER + 1e-4; 3])[0] - SHOULDER;
    assert!((above - 1e-4).abs() < 1e-6, "{above}");
}

#[test]
fn shades_are_those_of_srgb() {
    let shades = Shades::new();
    let lights = (0..=100_000).map(|step| f64::from(step) / 100_000.0);
    let off = lights.map(|light| (shades.of(light) - encode(light)).abs()).fold(0.0, f64::max);
    assert!(off < 2e-5, "{off}");
    assert_eq!([-1.0, 0.0, 1.0, 2.0].map(|light| shades.of(light)), [0.0, 0.0, 1.0, 1.0].map(encode));
}

#[test]
fn the_png_holds_the_pixels() {
    let pixels = (0..6).map(|shade| shade * 50).collect();
    let picture = Picture { width: 3, height: 2, channels: 1, pixels };
    let mut bytes = Vec::new();
    picture.write_png(&mut bytes).unwrap();
    let mut reader = png::Decoder::new(io::Cursor::new(bytes)).read_info().unwrap();
    let mut read = vec![0; 6];
    let info = reader.next_frame(&mut read).unwrap();
    assert_eq!((info.width, info.height, info.color_type), (3, 2, png::ColorType::Grayscale));
    assert_eq!(read, picture.pixels);
}
