// The fuzz target of the reader of luminaires: whatever a file holds, it must not panic, run for ever or take memory without end, and what it reads is
// a distribution that can be sampled.

use photometry::Luminaire;

pub fn luminaire(content: &[u8]) {
    let Ok(luminaire) = Luminaire::read(content) else { return };
    let distribution = &luminaire.distribution;
    let flux = distribution.flux();
    assert!(flux.is_finite() && flux > 0.0, "a flux of {flux}");
    assert!(distribution.numbers().all(f64::is_finite));
    let peak = distribution.peak();
    for axis in
        [glam::DVec3::X, glam::DVec3::NEG_Y, glam::DVec3::Z, glam::DVec3::NEG_Z, glam::DVec3::ONE.normalize()]
    {
        let intensity = distribution.intensity(axis);
        assert!((0.0..=peak * (1.0 + 1e-9)).contains(&intensity), "{intensity} of {peak}");
    }
    let _ = (luminaire.beam(0.0), luminaire.lines(), luminaire.json(), luminaire.polar_svg());
}
