//! Files of both formats: what they mean, what is refused, and that none stops the reader.

use crate::support::{Random, direction, ies, ldt};
use photometry::{Luminaire, LuminousOpening, Symmetry};

const FILES: [&[u8]; 4] = [
    include_bytes!("lamps/lambert.ies"),
    include_bytes!("lamps/lambert.ldt"),
    include_bytes!("lamps/strip.ies"),
    include_bytes!("lamps/strip.ldt"),
];

fn read(text: &str) -> Luminaire {
    Luminaire::read(text.as_bytes()).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn one_lamp_in_both_formats_is_one_lamp() {
    for pair in FILES.chunks(2) {
        let [ies, ldt] = [0, 1].map(|k| Luminaire::read(pair[k]).unwrap());
        assert_eq!(ies.distribution, ldt.distribution);
        assert_eq!(
            (&ies.name, &ies.catalogue, &ies.manufacturer),
            (&ldt.name, &ldt.catalogue, &ldt.manufacturer)
        );
        assert_eq!((ies.watts, ies.shape, ies.symmetry), (ldt.watts, ldt.shape, ldt.symmetry));
        assert_eq!(ies.lamps[0], ldt.lamps[0]);
    }
}

/// A made-up intensity with a symmetry, and the same planes by both formats.
#[test]
fn symmetries_complete_the_circle_alike() {
    let gamma: Vec<f64> = (0..=18).map(|k| 10.0 * f64::from(k)).collect();
    let circle: Vec<f64> = (0..24).map(|k| 15.0 * f64::from(k)).collect();
    let range = |from: u32, to: u32| (from..=to).map(|k| 15.0 * f64::from(k)).collect::<Vec<_>>();
    // x and y are cosines of C times sin γ: even in y about C0, even in x about C90.
    let cosine = |degrees: f64| (degrees.to_radians().cos() * 1e6).round() / 1e6;
    let [x, y] = [|c: f64, _: f64| c, |c: f64, _: f64| c - 90.0];
    let about = |c: f64, g: f64, of: fn(f64, f64) -> f64| cosine(of(c, g)) * (1.0 - cosine(2.0 * g));
    let free = |c: f64, g: f64| (200.0 + 50.0 * about(c, g, x) + 30.0 * about(c, g, y)).round();
    let c0 = |c: f64, g: f64| (200.0 + 50.0 * about(c, g, x)).round();
    let c90 = |c: f64, g: f64| (200.0 + 30.0 * about(c, g, y)).round();
    let both = |c: f64, g: f64| (200.0 + 50.0 * about(c, g, x).powi(2)).round();
    type Law<'a> = &'a dyn Fn(f64, f64) -> f64;
    type Case<'a> = (Symmetry, u32, Law<'a>, Vec<f64>, Vec<f64>);
    let cases: [Case; 4] = [
        (Symmetry::None, 0, &free, range(0, 24), range(0, 23)),
        (Symmetry::C0, 2, &c0, range(0, 12), range(0, 12)),
        (Symmetry::C90, 3, &c90, range(6, 18), [range(18, 23), range(0, 6)].concat()),
        (Symmetry::Quadrants, 4, &both, range(0, 6), range(0, 6)),
    ];
    for (symmetry, isym, law, ies_planes, ldt_planes) in cases {
        let one = read(&ies(1995, 1, &ies_planes, &gamma, &mut |c, g| law(c, g)));
        let two = read(&ldt(isym, &circle, &ldt_planes, &gamma, &mut |c, g| law(c, g)));
        assert_eq!((one.symmetry, two.symmetry), (symmetry, symmetry));
        assert_eq!(one.distribution, two.distribution, "{symmetry:?}");
        for c in &circle {
            for g in &gamma[1..18] {
                let (found, expected) = (one.distribution.intensity(direction(*c, *g)), law(*c, *g));
                assert!(
                    (found - expected).abs() < 1e-6 * expected,
                    "{symmetry:?}: {found}, {expected} at C{c} γ{g}"
                );
            }
        }
    }
}

#[test]
fn a_lambertian_lamp_has_the_figures_of_one() {
    let lamp = Luminaire::read(FILES[0]).unwrap();
    // Linear steps of 2.5° in a cosine lie below it by at most 1 − cos 1.25°, in the mean 1.6·10⁻⁴.
    assert!((lamp.distribution.flux() / 1000.0 - 1.0).abs() < 3e-4, "{}", lamp.distribution.flux());
    for gamma in [0.0, 10.0, 47.5, 80.0] {
        let expected = 1000.0 / std::f64::consts::PI * f64::to_radians(gamma).cos();
        assert!((lamp.distribution.intensity(direction(77.0, gamma)) / expected - 1.0).abs() < 1e-4);
    }
    for c in [0.0, 90.0] {
        let beam = lamp.beam(c);
        assert!((beam.beam.unwrap() - 120.0).abs() < 0.05, "{beam:?}");
        // cos 84.26° = 0.1.
        assert!((beam.field.unwrap() - 168.52).abs() < 0.05, "{beam:?}");
    }
    assert!((lamp.efficacy().unwrap() - 100.0).abs() < 0.05);
    assert_eq!((lamp.output_ratio(), lamp.shape), (None, LuminousOpening::Rectangle { x: 0.6, y: 0.6 }));
}

#[test]
fn factors_units_and_lamps_count() {
    let text = |head: &str, numbers: &str| format!("{head}\nTILT=NONE\n{numbers}\n0,90\n0\n100 100\n");
    let lamp = read(&text("IESNA91\n[LUMINAIRE] A", "2 800 1.5 2 1 1 1 2 -1 0\n0.9 0.8 60"));
    let down = lamp.distribution.intensity(direction(0.0, 0.0));
    assert!((down - 100.0 * 1.5 * 0.9 * 0.8).abs() < 1e-12);
    assert_eq!(lamp.shape, LuminousOpening::Disc { x: 0.3048, y: 0.6096 });
    assert_eq!((lamp.lamp_flux(), lamp.watts), (Some(1600.0), Some(60.0)));
    // From 2002 on the second factor is none.
    let lamp = read(&text("IES:LM-63-2019", "1 -1 1.5 2 1 1 2 0 0 0\n0.9 1.10000 0"));
    assert!((lamp.distribution.intensity(direction(0.0, 0.0)) - 135.0).abs() < 1e-12);
    assert_eq!((lamp.lamp_flux(), lamp.watts), (None, None));
    // 1986: lines of text without keywords.
    let lamp = read(&text("A luminaire of old\nits lamp", "1 1000 1 2 1 1 2 0 0 0\n1 1 0"));
    assert_eq!((lamp.name.as_str(), lamp.format.as_str()), ("A luminaire of old", "IES LM-63-1986, type C"));

    let spaced =
        text("IESNA:LM-63-2002", "1 -1 1 2 1 1 2 0 0 0\n1 1 0").replace("TILT=NONE", " tilt = None ");
    assert_eq!(read(&spaced).distribution.intensity(direction(0.0, 0.0)), 100.0);

    let latin = b"IESNA:LM-63-2002\r\n[LUMINAIRE] Stra\xDFe\r\nTILT=NONE\r\n1 -1 1 2 1 1 2 0 0 0 1 1 5\r\n0 90 0 7 3\r\n\x1A";
    assert_eq!(Luminaire::read(latin).unwrap().name, "Straße");

    // EULUMDAT: cd/klm of the first set; a decimal comma is a point.
    let text = String::from_utf8(FILES[3].into()).unwrap().replacen("\r\n1000\r\n", "\r\n2500,5\r\n", 1);
    let (lamp, before) = (read(&text), Luminaire::read(FILES[3]).unwrap());
    assert!((lamp.distribution.flux() / before.distribution.flux() - 2.5005).abs() < 1e-12);
    assert_eq!((lamp.lamps.len(), lamp.stated_ratio), (2, Some(0.8)));
}

#[test]
fn openings_follow_the_signs_of_their_extents() {
    let shape = |edition: &str, size: &str| {
        let text = format!("IESNA:LM-63-{edition}\nTILT=NONE\n1 -1 1 2 1 1 2 {size} 1 1 9 0 90 0 5 5");
        Luminaire::read(text.as_bytes()).map(|lamp| lamp.shape)
    };
    let cylinder = |size, axis| LuminousOpening::Cylinder { size, axis };
    // Width is along C90, length along C0.
    let cases = [
        ("1995", "0 0 0", LuminousOpening::Point),
        ("1995", "2 1 0", LuminousOpening::Rectangle { x: 1.0, y: 2.0 }),
        ("2002", "2 1 3", LuminousOpening::Box { size: [1.0, 2.0, 3.0] }),
        ("1995", "-2 0 0", LuminousOpening::Disc { x: 2.0, y: 2.0 }),
        ("2002", "-2 -1 0", LuminousOpening::Disc { x: 1.0, y: 2.0 }),
        ("1995", "-2 0 3", cylinder([2.0, 2.0, 3.0], 2)),
        ("2002", "-2 -2 3", cylinder([2.0, 2.0, 3.0], 2)),
        ("1995", "-2 0 -2", LuminousOpening::Ellipsoid { size: [2.0; 3] }),
        ("2002", "-2 -2 -2", LuminousOpening::Ellipsoid { size: [2.0; 3] }),
        ("1995", "0 3 -2", cylinder([3.0, 2.0, 2.0], 0)),
        ("1995", "3 0 -2", cylinder([2.0, 3.0, 2.0], 1)),
        ("2002", "-2 3 -2", cylinder([3.0, 2.0, 2.0], 0)),
        ("2002", "3 -2 -2", cylinder([2.0, 3.0, 2.0], 1)),
        ("1995", "-2 3 -1", LuminousOpening::Ellipsoid { size: [3.0, 2.0, 1.0] }),
        ("2002", "-2 0 -2", cylinder([0.0, 2.0, 2.0], 0)),
    ];
    for (edition, size, expected) in cases {
        assert_eq!(shape(edition, size), Ok(expected), "{edition}: {size}");
    }
    let refused = shape("2002", "1 1 -1").unwrap_err().to_string();
    assert!(refused.starts_with("3: width 1 m, length 1 m and height -1 m"), "{refused}");
}

/// However a first line writes its edition, up to 1995 the ballast-lamp factor weakens the light.
#[test]
fn editions_are_told_by_their_years() {
    let lamp = |header: &str| {
        let text = format!("{header}\n[MANUFAC] A\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0 1 0.5 9 0 90 0 5 5");
        read(&text)
    };
    for (headers, format, part) in [
        (&["IESNA86", "IESNA:LM-63-1986"][..], "1986", 0.5),
        (&["IESNA91", "IESNA:LM-63-1991", "IESNA:LM-63-91"], "1991", 0.5),
        (&["IESNA95", "IESNA:LM-63-1995", "IESNA:LM-63-95"], "1995", 0.5),
        (&["IESNA:LM-63-2002", "IES:LM-63-2002", "IESNA:LM-63-02", "IESNA:LM-63-next"], "2002", 1.0),
        (&["IES:LM-63-2019", "IESNA:LM-63-2019", "IES:LM-63-2033"], "2019", 1.0),
    ] {
        for header in headers {
            let lamp = lamp(header);
            assert_eq!(lamp.format, format!("IES LM-63-{format}, type C"), "{header}");
            let flux = 2.0 * std::f64::consts::PI * 5.0 * part;
            assert!((lamp.distribution.flux() / flux - 1.0).abs() < 1e-9, "{header}");
        }
    }
}

/// Horizontal angles of types A and B are clockwise: towards −y. Type A looks along x, type B down.
#[test]
fn types_a_and_b_have_their_own_poles() {
    let angles = [-90.0, 0.0, 45.0, 90.0];
    let bright = |kind, at: (f64, f64)| {
        let text = ies(2002, kind, &angles, &angles, &mut |h, v| if (h, v) == at { 10.0 } else { 1.0 });
        read(&text).distribution
    };
    let close = |found: f64| assert!((found - 10.0).abs() < 1e-9, "{found}");
    use glam::DVec3;
    close(bright(3, (0.0, 0.0)).intensity(DVec3::X));
    close(bright(3, (90.0, 0.0)).intensity(DVec3::NEG_Y));
    close(bright(3, (0.0, 45.0)).intensity(DVec3::X + DVec3::Z));
    close(bright(2, (0.0, 0.0)).intensity(DVec3::NEG_Z));
    close(bright(2, (90.0, 0.0)).intensity(DVec3::NEG_Y));
    close(bright(2, (0.0, 45.0)).intensity(DVec3::X - DVec3::Z));
    // What was not measured is dark.
    assert_eq!(bright(3, (0.0, 0.0)).intensity(DVec3::NEG_X), 0.0);
    // From 0 on, the left is as the right.
    let half = read(&ies(2002, 2, &angles[1..], &angles, &mut |h, _| 1.0 + h)).distribution;
    let [left, right] = [DVec3::Y, DVec3::NEG_Y].map(|side| half.intensity(side - DVec3::Z));
    assert!((left - 46.0).abs() < 1e-9 && left == right);
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let ies = |numbers: &str| format!("IESNA:LM-63-2002\nTILT=NONE\n{numbers}");
    let good = String::from_utf8(FILES[3].into()).unwrap();
    let line = |number: usize, text: &str| {
        let mut lines: Vec<&str> = good.split("\r\n").collect();
        lines[number - 1] = text;
        lines.join("\r\n")
    };
    let cases = [
        (String::new(), "1: neither LM-63 nor EULUMDAT"),
        ("IESNA91\n1 2 3".into(), "1: there is no line TILT="),
        ("IESNA91\nTILT=a.tlt\n".into(), "2: TILT=\"a.tlt\" names another file"),
        (ies("1 -1 1"), "3: the file ends where the number of vertical angles is expected"),
        (ies("1 -1 1 x"), "3: \"x\" stands where the number of vertical angles is expected"),
        (ies("1 -1 1 5000 1 1 2 0 0 0"), "3: the number of vertical angles is 5000"),
        (ies("1 -1 1 4096 4096 1 2 0 0 0"), "3: 4096 × 4096 intensities"),
        (ies("1 -1 1 2 1 4 2 0 0 0"), "3: the type of photometry is 4"),
        (ies("1 -1 0 2 1 1 2 0 0 0\n1 1 1"), "4: multiplier × ballast factors is 0"),
        (ies("1 -1 1 2 1 1 2 0 0 0\n1 1 1\n90 0\n0\n1 1"), "5: the vertical angle 0° follows 90°"),
        (ies("1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 190\n0\n1 1"), "5: the vertical angle 190° is outside 0–180°"),
        (
            ies("1 -1 1 2 3 1 2 0 0 0\n1 1 1\n0 90\n0 100 200\n1 1 1 1 1 1"),
            "6: horizontal angles from 0° to 200°",
        ),
        (
            ies("1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 -1"),
            "7: the intensity -1 in the plane of 0° is negative",
        ),
        (
            ies("1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 1 1"),
            "7: \"1\" follows the last of 1 × 2 intensities",
        ),
        (ies("1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n0 0"), "7: all intensities are 0"),
        (
            ies("1 -1 1 2 1 3 2 0 0 0\n1 1 1\n0 90\n0\n1 1"),
            "6: one horizontal angle in photometry of type A or B",
        ),
        (line(4, "22"), "4: 22 C planes with symmetry 4"),
        (line(6, "1"), "6: the number of angles in a plane is 1"),
        (line(16, "-3"), "16: an extent of the luminous area is -3"),
        (line(26, "0"), "26: the number of lamp sets is 0"),
        (line(29, "0"), "29: the flux 0 lm × the conversion factor 1 is not positive"),
        (line(50, "0"), "49: the C plane 0° follows 0°"),
        (line(55, "91"), "49: with symmetry 4 the planes given are C0 to C91 (they must be C0 to C90)"),
        (line(100, "?"), "100: \"?\" stands where an intensity is expected"),
    ];
    for (text, expected) in cases {
        let Err(error) = Luminaire::read(text.as_bytes()) else { panic!("this was read: {expected}") };
        let error = error.to_string();
        assert!(error.starts_with(expected), "{error}\nand not: {expected}");
        assert!(error.contains(" (") && error.contains("); "), "no reason or no remedy: {error}");
    }
    let cut: Vec<&str> = good.split("\r\n").take(150).collect();
    let error = Luminaire::read(cut.join("\r\n").as_bytes()).unwrap_err();
    assert_eq!(error.line, 150);
}

/// 10⁵ files with bytes changed, cut out, doubled or put in, and what is said of those that are read.
#[test]
fn no_file_stops_the_reader() {
    let words: [&[u8]; 12] = [
        b"1e308",
        b"-1",
        b"nan",
        b"4096",
        b"0",
        b"\n",
        b"1e-320",
        b"TILT=INCLUDE\n1 2 0 90 1 1",
        b"\xFF",
        b"360",
        b",",
        b"1e9",
    ];
    let mut random = Random(7);
    let mut read = 0;
    for round in 0..100_000 {
        let mut bytes = FILES[round % 4].to_vec();
        for _ in 0..1 + random.below(3) {
            let place = random.below(bytes.len());
            match random.below(4) {
                0 => bytes[place] = random.bits() as u8,
                1 => {
                    let end = (place + 1 + random.below(40)).min(bytes.len());
                    bytes.drain(place..end);
                }
                2 => {
                    let word = words[random.below(words.len())];
                    bytes.splice(place..place, word.iter().copied());
                }
                _ => {
                    // A whole number becomes another.
                    let end = place + bytes[place..].iter().take_while(|byte| byte.is_ascii_digit()).count();
                    bytes.splice(place..end, words[random.below(words.len())].iter().copied());
                }
            }
        }
        let Ok(lamp) = Luminaire::read(&bytes) else { continue };
        read += 1;
        let d = glam::DVec3::from_array(std::array::from_fn(|_| random.next() - 0.5));
        assert!(lamp.distribution.flux() > 0.0 && lamp.distribution.intensity(d).is_finite());
        if read % 500 == 0 {
            assert!(lamp.polar_svg().ends_with("</svg>\n") && lamp.lines().len() > 5);
        }
    }
    assert!((10_000..90_000).contains(&read), "{read} files were read");
}

#[test]
fn the_curve_and_the_lines_say_what_is_in_the_file() {
    let lamp = Luminaire::read(FILES[2]).unwrap();
    let svg = lamp.polar_svg();
    for text in [
        "Strip, two lamps, light upwards",
        "C0–C180 [cd/klm]",
        "C90–C270 [cd/klm]",
        "<circle",
        ">50<",
        ">120°<",
    ] {
        assert!(svg.contains(text), "{text} in {svg}");
    }
    let lines = lamp.lines().join("\n");
    for text in [
        "IES LM-63-1995, type C",
        "2 × T16 28 W, 1,000 lm in all",
        "62 W",
        "% of the lamps' flux",
        "box, 0.2 m along C0–C180",
    ] {
        assert!(lines.contains(text), "{text} in {lines}");
    }
    // Light downwards alone has half a chart, in cd where the flux of the lamps is unknown.
    let svg = Luminaire::read(FILES[0]).unwrap().polar_svg();
    assert!(svg.contains("[cd]") && !svg.contains("<circle"), "{svg}");
    let json = lamp.json();
    assert_eq!((&json["watts"], &json["opening"]["shape"]), (&62.0.into(), &"box".into()));
}
