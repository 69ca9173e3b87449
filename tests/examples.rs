//! Every numbered example runs to its end.

/// The examples as modules, and a test that runs each.
macro_rules! examples {
    ($($name:ident: $path:literal),* $(,)?) => {
        $(
            #[path = $path]
            mod $name;

            #[test]
            fn $name() {
                $name::main().expect("the example ends without an error");
            }
        )*

        #[test]
        fn no_numbered_example_is_left_out() {
            let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
            for file in std::fs::read_dir(folder).expect("examples are there") {
                let path = file.expect("readable").path();
                let name = path.file_name().expect("a name").to_string_lossy().into_owned();
                let numbered = name.starts_with(|c: char| c.is_ascii_digit());
                assert!(!numbered || [$($path),*].iter().any(|p| p.ends_with(&name)), "{name} is not run");
            }
        }
    };
}

examples! {
    evaluate: "../examples/0_evaluate.rs",
    sample: "../examples/1_sample.rs",
    bake: "../examples/2_bake.rs",
    fit: "../examples/3_fit.rs",
    export: "../examples/4_export.rs",
    decode_texture: "../examples/5_decode_texture.rs",
    preview: "../examples/6_preview.rs",
    custom_material: "../examples/7_custom_material.rs",
}
