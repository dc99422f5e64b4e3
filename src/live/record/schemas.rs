//! Definitions of the ROS 2 messages that a recording holds, as its readers want them: each type with those that it uses.
//! The fields are those of common_interfaces (std_msgs, geometry_msgs, sensor_msgs, diagnostic_msgs; Apache-2.0).

/// A type of messages.
pub(super) struct Schema {
    pub name: &'static str,
    /// Its own fields.
    fields: &'static str,
    /// The types that those use, in any order.
    uses: &'static [(&'static str, &'static str)],
}

impl Schema {
    /// The definition with all that it uses (`ros2msg`).
    pub fn text(&self) -> String {
        let mut text = self.fields.to_owned();
        for (name, fields) in self.uses {
            text.push_str(&"=".repeat(80));
            text.push_str(&format!("\nMSG: {name}\n{fields}"));
        }
        text
    }
}

const TIME: (&str, &str) = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const HEADER: (&str, &str) = ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n");
const VECTOR: (&str, &str) = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: (&str, &str) =
    ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n");

pub(super) const FLOAT64: Schema =
    Schema { name: "std_msgs/msg/Float64", fields: "float64 data\n", uses: &[] };

pub(super) const COMPRESSED_IMAGE: Schema = Schema {
    name: "sensor_msgs/msg/CompressedImage",
    fields: "std_msgs/Header header\nstring format\nuint8[] data\n",
    uses: &[HEADER, TIME],
};

pub(super) const IMAGE: Schema = Schema {
    name: "sensor_msgs/msg/Image",
    fields: "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n\
        uint8[] data\n",
    uses: &[HEADER, TIME],
};

pub(super) const WRENCH: Schema = Schema {
    name: "geometry_msgs/msg/WrenchStamped",
    fields: "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
    uses: &[
        HEADER,
        TIME,
        ("geometry_msgs/Wrench", "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n"),
        VECTOR,
    ],
};

pub(super) const POSE: Schema = Schema {
    name: "geometry_msgs/msg/PoseStamped",
    fields: "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
    uses: &[
        HEADER,
        TIME,
        ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"),
        ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
        QUATERNION,
    ],
};

pub(super) const TRANSFORMS: Schema = Schema {
    name: "tf2_msgs/msg/TFMessage",
    fields: "geometry_msgs/TransformStamped[] transforms\n",
    uses: &[
        (
            "geometry_msgs/TransformStamped",
            "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
        ),
        HEADER,
        TIME,
        ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"),
        VECTOR,
        QUATERNION,
    ],
};

pub(super) const POINT_CLOUD: Schema = Schema {
    name: "sensor_msgs/msg/PointCloud2",
    fields: "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\n\
        uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    uses: &[
        HEADER,
        TIME,
        (
            "sensor_msgs/PointField",
            "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n\
            uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
        ),
    ],
};

pub(super) const DIAGNOSTICS: Schema = Schema {
    name: "diagnostic_msgs/msg/DiagnosticArray",
    fields: "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n",
    uses: &[
        HEADER,
        TIME,
        (
            "diagnostic_msgs/DiagnosticStatus",
            "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\nstring message\n\
            string hardware_id\ndiagnostic_msgs/KeyValue[] values\n",
        ),
        ("diagnostic_msgs/KeyValue", "string key\nstring value\n"),
    ],
};
