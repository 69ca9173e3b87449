//! The command line as a user sees it: each file under tests/cmd is a session with its output.

#[test]
fn sessions_print_what_they_printed() {
    trycmd::TestCases::new().case("tests/cmd/*.trycmd");
}
