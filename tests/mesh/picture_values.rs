//! Bodies colored by values: the colors at both ends and the middle, interpolation, and refused arguments.

use crate::support::bodies::FREE;
use glam::Vec3;
use sinew::raster::{ColourScale, Colours, Image};
use sinew::{BodyDefinition, BodyId, BodyValues, Error, PictureDefinition, Values, World};

/// Pixels, enough to show springs.
const HEIGHT: u32 = 480;

const SCALE: ColourScale = ColourScale {
    colours: Colours::Diverging,
    low: -2.0,
    high: 6.0,
};

/// Creates a square that faces the eye, as a surface or as two springs along x.
fn square(is_surface: bool) -> (World, BodyId) {
    let mut world = World::new(FREE).expect("a world");
    let positions = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
    let body = world.create_body(&BodyDefinition {
        positions: &positions,
        masses: Values::Uniform(1.0),
        springs: Some(&[[0, 1], [2, 3]]),
        triangles: if is_surface { &[[0, 1, 2], [0, 2, 3]] } else { &[] },
        ..BodyDefinition::default()
    });
    let body = body.expect("a body");
    (world, body)
}

fn draw(world: &World, coloured: &[BodyValues]) -> Result<Image, Error> {
    let definition = PictureDefinition {
        width: 3 * HEIGHT / 2,
        height: HEIGHT,
        eye_and_target: Some((Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO)),
        ..PictureDefinition::default()
    };
    world.picture_of_values(&definition, coloured)
}

/// Returns red, green and blue of the body at this fraction of its width.
fn color_at(image: &Image, part: f32, row: u32) -> [i32; 3] {
    // The square is 2 m wide, and the picture 2 * 5 tan(0.3) m high.
    let pixels_per_metre = HEIGHT as f32 / (10.0 * 0.3_f32.tan());
    let column = 0.75 * HEIGHT as f32 + (2.0 * part - 1.0) * pixels_per_metre;
    let [red, green, blue, _] = image.pixels[(row * 3 * HEIGHT / 2) as usize + column as usize];
    [red, green, blue].map(i32::from)
}

#[test]
fn a_surface_is_colored_from_blue_over_gray_to_red() {
    let (world, body) = square(true);
    let values = [-2.0, 6.0, 6.0, -2.0];
    let body_values = |values, scale| BodyValues { body, values, scale };
    let image = draw(&world, &[body_values(&values, SCALE)]).expect("a picture");
    let [red, _, blue] = color_at(&image, 0.03, HEIGHT / 2);
    assert!(blue > red + 60, "{red} {blue}");
    let [red, green, blue] = color_at(&image, 0.5, HEIGHT / 2);
    assert!(
        (red - blue).abs() < 20 && (red - green).abs() < 20 && red > 150,
        "{red} {green} {blue}"
    );
    let [red, _, blue] = color_at(&image, 0.97, HEIGHT / 2);
    assert!(red > blue + 60, "{red} {blue}");
    // Red increases relative to blue along the whole width.
    let balance: Vec<i32> = (1..20)
        .map(|part| color_at(&image, part as f32 / 20.0, HEIGHT / 2))
        .map(|c| c[0] - c[2])
        .collect();
    assert!(balance.windows(2).all(|pair| pair[0] < pair[1] + 3), "{balance:?}");
    // Values outside the range have the colors of its ends.
    let narrow = ColourScale {
        low: 1.9,
        high: 2.1,
        ..SCALE
    };
    let ends = draw(&world, &[body_values(&values, narrow)]).expect("a picture");
    assert!(color_at(&ends, 0.2, HEIGHT / 2)[2] > color_at(&ends, 0.2, HEIGHT / 2)[0] + 60);
    assert!(color_at(&ends, 0.8, HEIGHT / 2)[0] > color_at(&ends, 0.8, HEIGHT / 2)[2] + 60);
    // Without values, the picture is the plain one.
    let plain = draw(&world, &[]).expect("a picture");
    assert_ne!(plain, image);
    let definition = PictureDefinition {
        width: 3 * HEIGHT / 2,
        height: HEIGHT,
        eye_and_target: Some((Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO)),
        ..PictureDefinition::default()
    };
    assert_eq!(world.picture(&definition).expect("a picture"), plain);
}

#[test]
fn lightness_increases_along_a_sequential_scale() {
    let (world, body) = square(true);
    let values = [0.0, 1.0, 1.0, 0.0];
    let scale = ColourScale {
        colours: Colours::Sequential,
        low: 0.0,
        high: 1.0,
    };
    let image = draw(
        &world,
        &[BodyValues {
            body,
            values: &values,
            scale,
        }],
    )
    .expect("a picture");
    let light = |part: f32| {
        let [red, green, blue] = color_at(&image, part, HEIGHT / 2);
        2 * red + 7 * green + blue
    };
    let light: Vec<i32> = (1..20).map(|part| light(part as f32 / 20.0)).collect();
    assert!(light.windows(2).all(|pair| pair[0] < pair[1]), "{light:?}");
    assert!(light[18] > 2 * light[0], "{light:?}");
}

#[test]
fn springs_of_a_body_without_a_surface_are_colored_too() {
    let (world, body) = square(false);
    let values = [-2.0, 6.0, 6.0, -2.0];
    let scale = SCALE;
    let image = draw(
        &world,
        &[BodyValues {
            body,
            values: &values,
            scale,
        }],
    )
    .expect("a picture");
    // The springs lie along the upper and the lower side.
    for row in 0..HEIGHT {
        let [left, right] = [0.1, 0.9]
            .map(|part| color_at(&image, part, row))
            .map(|[red, _, blue]| red - blue);
        let background = color_at(&image, -0.2, row);
        let background = background[0] - background[2];
        if (left - background).abs() + (right - background).abs() > 10 {
            assert!(left < right, "row {row}: {left} {right}");
        }
    }
    let left: Vec<i32> = (0..HEIGHT)
        .map(|row| color_at(&image, 0.1, row))
        .map(|[red, _, blue]| red - blue)
        .collect();
    let right: Vec<i32> = (0..HEIGHT)
        .map(|row| color_at(&image, 0.9, row))
        .map(|[red, _, blue]| red - blue)
        .collect();
    assert!(left.iter().min().expect("rows") < &-40, "{left:?}");
    assert!(right.iter().max().expect("rows") > &20, "{right:?}");
}

#[test]
fn invalid_values_are_refused_by_name() {
    let (mut world, body) = square(true);
    let refused = |world: &World, values: &[f32], low, high, name: &str| {
        let scale = ColourScale { low, high, ..SCALE };
        let message = draw(world, &[BodyValues { body, values, scale }])
            .expect_err(name)
            .to_string();
        assert!(message.contains(name), "{message}");
    };
    let good = [0.0; 4];
    refused(&world, &good[..3], 0.0, 1.0, "values");
    refused(&world, &[0.0, f32::NAN, 0.0, 0.0], 0.0, 1.0, "values[1]");
    for (low, high) in [(1.0, 1.0), (1.0, 0.0), (f32::NAN, 1.0), (0.0, f32::INFINITY)] {
        refused(&world, &good, low, high, "low");
    }
    world.destroy_body(body).expect("the body");
    let stale = draw(
        &world,
        &[BodyValues {
            body,
            values: &good,
            scale: SCALE,
        }],
    );
    assert!(matches!(stale, Err(Error::StaleId(_))), "{stale:?}");
}
