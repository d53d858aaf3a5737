//! Tests of the archives.

use super::*;

#[test]
fn headers_of_numpy_in_any_order_are_read_and_others_refused_at_once() {
    let numpy = "{'shape': (3, 4), 'descr': '<f4', 'fortran_order': True}    \n";
    let header = Header { descr: "<f4".into(), column_major: true, shape: vec![3, 4] };
    assert_eq!(Header::of(numpy), Some(header));
    assert_eq!(
        Header::of("{'descr': '|u1', 'fortran_order': False, 'shape': (), }").map(|h| h.shape),
        Some(vec![])
    );
    for text in [
        "",
        "{",
        "{}",
        "{'descr'}",
        "{'descr': }",
        "{'descr': '",
        "{'descr': '<f4'}",
        "{'descr': '<f4', 'fortran_order': Maybe, 'shape': (1,)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (-1,)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1}",
        "{'descr': 'é', 'fortran_order': False, 'shape': 7}",
    ] {
        assert_eq!(Header::of(text), None, "{text}");
    }
    // A parser that backtracks would never finish this header.
    assert_eq!(Header::of(&format!("{{'shape': {}", "(".repeat(60_000))), None);
}
