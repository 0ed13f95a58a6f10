//! Tests that the small scenes are valid and as described, and that scene files describe the scenes they are written
//! from.

use job::to_toml;
use radiosity::{Birth, Estimator, Experiment, IndexChoice, Method, Scene, Sequence};
use scenes::{cornell, corridor, cube, cube_of_surfaces, furnace, in_cells, interior, room};

#[test]
fn the_cube_is_that_of_the_shipped_scene_file() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/scenes/cube54.toml");
    let shipped = job::load_scene(&file).unwrap().build(IndexChoice::Auto).unwrap();
    let made = Scene::build(&cube(3), IndexChoice::Auto).unwrap();
    assert_eq!(made.hash(), shipped.hash());
}

#[test]
fn the_cornell_box_is_small_enough_for_no_tree() {
    let scene = Scene::build(&cornell(), IndexChoice::Auto).unwrap();
    assert_eq!(scene.surfaces().len(), 21);
    assert!(!scene.has_tree());
    let lamp = scene.surfaces()[0].normal();
    assert!(lamp.y < 0.0, "the lamp shines down");
}

#[test]
fn a_scene_file_reads_back_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.toml");
    for spec in [cube(3), cornell(), interior(50_000)] {
        std::fs::write(&file, to_toml(&spec)).unwrap();
        assert_eq!(job::load_scene(&file).unwrap().spec().surfaces.len(), spec.surfaces.len());
        let read = job::load_scene(&file).unwrap().build(IndexChoice::Auto).unwrap();
        assert_eq!(read.hash(), Scene::build(&spec, IndexChoice::Auto).unwrap().hash());
    }
}

#[test]
fn a_cube_of_surfaces_has_the_patches_of_the_cube() {
    let whole = Scene::build(&cube(3), IndexChoice::Auto).unwrap();
    let parts = Scene::build(&cube_of_surfaces(3), IndexChoice::Auto).unwrap();
    assert_eq!(parts.surfaces().len(), 54);
    for (a, b) in whole.faces().iter().zip(parts.faces()) {
        assert!((a.centroid - b.centroid).length() < 1e-15 && (a.area - b.area).abs() < 1e-15);
        assert_eq!((a.reflectance, a.emittance), (b.reflectance, b.emittance));
    }
}

#[test]
fn the_boxes_of_the_papers_are_closed_and_as_large_as_published() {
    for (spec, surfaces, patches) in [
        (furnace(16, 0.5), 6, 1_536),
        (corridor(8), 6, 306),
        (in_cells(&corridor(2)), 90, 90),
        (room(4), 16, 256),
        (room(16), 16, 4_096),
    ] {
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        assert_eq!((scene.surfaces().len(), scene.faces().patch_count()), (surfaces, patches));
        let method = Method::gathering(Birth::Area, Estimator::Collision);
        let experiment = Experiment::new(scene, method).unwrap();
        let mut board = experiment.board();
        experiment.walk(&Sequence::new(1), 0..20_000, &mut board);
        assert_eq!(board.take().unwrap().counts.absorbed, 20_000, "no ray escapes or meets a back");
    }
}
