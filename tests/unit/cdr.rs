//! Messages in bytes: schemas, alignment, both orders of bytes, and what is refused.

use super::*;

const NESTED: &str = "\
# A comment
uint8 KIND=3
std_msgs/Header header
bool flag
float64 x   # behind a flag
string<=10 name \"default\"
float32[] list
int16[2] pair
Inner[] inner
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: my_msgs/Inner
int8 a
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";

/// The same message in either order of bytes, with padding as the standard has it.
fn bytes(little: bool) -> Vec<u8> {
    let mut body: Vec<u8> = Vec::new();
    let put = |body: &mut Vec<u8>, size: usize, bits: u64| {
        while !body.len().is_multiple_of(size) {
            body.push(0xee);
        }
        let own = &bits.to_le_bytes()[..size];
        match little {
            true => body.extend(own),
            false => body.extend(own.iter().rev()),
        }
    };
    put(&mut body, 4, 7);
    put(&mut body, 4, 500);
    put(&mut body, 4, 2);
    body.extend(b"w\0");
    put(&mut body, 1, 1);
    put(&mut body, 8, (-2.5f64).to_bits());
    put(&mut body, 4, 3);
    body.extend(b"ab\0");
    put(&mut body, 4, 2);
    put(&mut body, 4, u64::from(0.5f32.to_bits()));
    put(&mut body, 4, u64::from(1.5f32.to_bits()));
    put(&mut body, 2, 0xfffe);
    put(&mut body, 2, 9);
    put(&mut body, 4, 1);
    put(&mut body, 1, 0xff);
    [vec![0, u8::from(little), 0, 0], body].concat()
}

#[test]
fn a_message_is_the_same_in_either_order_of_bytes() {
    let schema = Schema::parse("my_msgs/msg/Thing", NESTED).expect("it is a schema");
    for little in [true, false] {
        let bytes = bytes(little);
        let value = decode(&schema, Form::Cdr, &bytes).expect("it is decoded");
        let number = |name: &str| value.get(name).and_then(Value::number);
        assert_eq!((number("flag"), number("x")), (Some(1.0), Some(-2.5)));
        assert_eq!(value.get("name").and_then(Value::text).as_deref(), Some("ab"));
        assert_eq!(
            value.get("list").expect("a list").list(),
            [Value::Number(0.5), Value::Number(1.5)]
        );
        assert_eq!(
            value.get("pair").expect("a pair").list(),
            [Value::Number(-2.0), Value::Number(9.0)]
        );
        let inner = value.get("inner").expect("a list").list();
        assert_eq!(inner[0].get("a").and_then(Value::number), Some(-1.0));
        let stamp = value.get("header").and_then(|h| h.get("stamp")).expect("a stamp");
        assert_eq!(stamp.get("nanosec").and_then(Value::number), Some(500.0));
        // Every cut is refused with its place.
        for end in 4..bytes.len() {
            let problem = decode(&schema, Form::Cdr, &bytes[..end]).expect_err("it is cut");
            assert!(problem.contains("in `"), "{problem}");
        }
    }
}

#[test]
fn what_is_no_message_is_refused_in_words() {
    let parse = |text: &str| Schema::parse("a/msg/B", text);
    assert_eq!(
        parse("other/Thing x").expect_err("it is refused"),
        "its schema does not define `other/Thing`"
    );
    assert!(parse("float64").expect_err("it is refused").contains("the line `float64`"));
    assert!(parse("float64[x] y").is_err());
    // A record in itself, by one and by many.
    let endless = parse("B b").expect("it is a schema");
    assert!(
        decode(&endless, Form::Cdr, &[0, 1, 0, 0, 1]).expect_err("endless").contains("32 deep")
    );
    let long = parse("float64[] x").expect("it is a schema");
    let problem =
        decode(&long, Form::Cdr, &[0, 1, 0, 0, 255, 255, 255, 255]).expect_err("too long");
    assert_eq!(problem, "counts 4294967295 with 0 bytes left in `x`");
    let empty = parse("Empty[] x\n===\nMSG: a/Empty\nuint8 ONE=1\n").expect("it is a schema");
    assert!(decode(&empty, Form::Cdr, &[0, 1, 0, 0, 2, 0, 0, 0, 9]).is_err());
    assert!(decode(&empty, Form::Cdr, &[0, 1, 0, 0, 2, 0, 0, 0, 9, 9]).is_ok());
    assert!(decode(&long, Form::Cdr, &[0, 3, 0, 0]).expect_err("another").contains("0x0003"));
    assert!(decode(&long, Form::Cdr, &[0]).is_err());
    // Records without bytes, each with many fields without bytes.
    let fields: String = (0..1_000).map(|field| format!("float64[0] f{field}\n")).collect();
    let nothing = parse(&format!("Nothing[1000000] x\n===\nMSG: a/Nothing\n{fields}"));
    let nothing = nothing.expect("it is a schema");
    let problem = decode(&nothing, Form::Ros1, &[0; 100]).expect_err("it is refused");
    assert!(problem.starts_with("has more values than its bytes explain in `x[2]"), "{problem}");
    // ROS 1 has no padding and no zero behind texts.
    let old = parse("uint8 a\ntime t\nstring s").expect("it is a schema");
    let bytes = [1, 2, 0, 0, 0, 3, 0, 0, 0, 1, 0, 0, 0, b'z'];
    let value = decode(&old, Form::Ros1, &bytes).expect("it is decoded");
    assert_eq!(value.get("s").and_then(Value::text).as_deref(), Some("z"));
    assert_eq!(value.get("t").and_then(|t| t.get("nanosec")).and_then(Value::number), Some(3.0));
}
