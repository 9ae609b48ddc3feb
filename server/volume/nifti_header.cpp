#include "server/volume/nifti_header.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "server/volume/decoder.h"
#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

constexpr std::size_t kNifti1Size = 348, kNifti2Size = 540;  // bytes of a header

// Both versions have the same fields in other places. Offsets in bytes; a few fields are wider in the second.
struct Version {
  const char* name;
  std::size_t size, magic, datatype, dim, pixdim, vox_offset, slope, intercept, units, qform_code, sform_code, quatern, qoffset, srow, intent_name;
  bool is_second;
};
constexpr Version kNifti1{"NIfTI-1", kNifti1Size, 344, 70, 40, 76, 108, 112, 116, 123, 252, 254, 256, 268, 280, 328, false};
constexpr Version kNifti2{"NIfTI-2", kNifti2Size, 4, 12, 16, 104, 168, 176, 184, 500, 344, 348, 352, 376, 400, 508, true};

struct Found {
  const Version* version;
  bool big_endian;
};

std::optional<Found> find_version(std::string_view start) {
  for (const Version* version : {&kNifti1, &kNifti2}) {
    if (start.size() < version->size) continue;
    const std::string_view magic = start.substr(version->magic, 3);
    if (magic != (version->is_second ? "n+2" : "n+1") && magic != (version->is_second ? "ni2" : "ni1")) continue;
    for (const bool big : {false, true}) {
      if (HeaderBytes(start, big).number<std::int32_t>(0) == std::int32_t(version->size)) return Found{version, big};
    }
  }
  return {};
}

bool is_gzip(std::string_view start) { return start.starts_with("\x1f\x8b"); }

// The fields of either version.
class Fields {
 public:
  Fields(std::string_view bytes, const Found& found) : bytes_(bytes, found.big_endian), v_(*found.version) {}

  [[nodiscard]] std::int64_t dim(std::size_t k) const { return integer<std::int16_t, std::int64_t>(v_.dim, k); }
  [[nodiscard]] double pixdim(std::size_t k) const { return real(v_.pixdim, k); }
  [[nodiscard]] int datatype() const { return bytes_.number<std::int16_t>(v_.datatype); }
  [[nodiscard]] double vox_offset() const {
    return v_.is_second ? double(bytes_.number<std::int64_t>(v_.vox_offset)) : double(bytes_.number<float>(v_.vox_offset));
  }
  [[nodiscard]] double slope() const { return real(v_.slope, 0); }
  [[nodiscard]] double intercept() const { return real(v_.intercept, 0); }
  [[nodiscard]] int units() const { return v_.is_second ? bytes_.number<std::int32_t>(v_.units) : bytes_.number<std::uint8_t>(v_.units); }
  [[nodiscard]] bool has_qform() const { return integer<std::int16_t, std::int32_t>(v_.qform_code, 0) > 0; }
  [[nodiscard]] bool has_sform() const { return integer<std::int16_t, std::int32_t>(v_.sform_code, 0) > 0; }
  [[nodiscard]] double quatern(std::size_t k) const { return real(v_.quatern, k); }
  [[nodiscard]] double qoffset(std::size_t k) const { return real(v_.qoffset, k); }
  [[nodiscard]] double srow(std::size_t k) const { return real(v_.srow, k); }  // 12 numbers
  [[nodiscard]] std::string_view intent_name() const { return bytes_.text(v_.intent_name, 16); }

 private:
  template <class First, class Second>
  [[nodiscard]] Second integer(std::size_t at, std::size_t k) const {
    return v_.is_second ? bytes_.number<Second>(at + k * sizeof(Second)) : Second(bytes_.number<First>(at + k * sizeof(First)));
  }
  [[nodiscard]] double real(std::size_t at, std::size_t k) const {
    return v_.is_second ? bytes_.number<double>(at + k * sizeof(double)) : double(bytes_.number<float>(at + k * sizeof(float)));
  }

  HeaderBytes bytes_;
  const Version& v_;
};

std::optional<SampleType> nifti_type(int datatype) {
  switch (datatype) {
    case 2:
      return SampleType::u8;
    case 4:
      return SampleType::i16;
    case 8:
      return SampleType::i32;
    case 16:
      return SampleType::f32;
    case 64:
      return SampleType::f64;
    case 256:
      return SampleType::i8;
    case 512:
      return SampleType::u16;
    case 768:
      return SampleType::u32;
    default:
      return {};
  }
}

double distance(double pixdim) { return std::isfinite(pixdim) && pixdim != 0 ? std::abs(pixdim) : 1; }

// nifti1.h, "3D IMAGE (VOLUME) ORIENTATION AND LOCATION IN SPACE", method 2.
Affine affine_of_quaternion(const Fields& fields) {
  double b = fields.quatern(0), c = fields.quatern(1), d = fields.quatern(2);
  double a = 1 - (b * b + c * c + d * d);
  if (a < 1e-7) {  // a half turn, but for rounding
    const double length = std::sqrt(b * b + c * c + d * d);
    b /= length;
    c /= length;
    d /= length;
    a = 0;
  } else {
    a = std::sqrt(a);
  }
  const std::array<Vec3, 3> turned{{{a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)},
                                    {2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)},
                                    {2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c}}};
  const double mirror = fields.pixdim(0) < 0 ? -1 : 1;
  return Affine::of_columns({scaled(distance(fields.pixdim(1)), turned[0]), scaled(distance(fields.pixdim(2)), turned[1]),
                             scaled(mirror * distance(fields.pixdim(3)), turned[2])},
                            {fields.qoffset(0), fields.qoffset(1), fields.qoffset(2)});
}

Affine affine_of(const Fields& fields) {
  if (fields.has_sform()) {
    Affine affine;
    for (std::size_t k = 0; k < affine.rows.size(); ++k) affine.rows[k] = fields.srow(k);
    return affine;
  }
  if (fields.has_qform()) return affine_of_quaternion(fields);
  return Affine::of({distance(fields.pixdim(1)), distance(fields.pixdim(2)), distance(fields.pixdim(3))});
}

const char* unit_of(int units) {
  switch (units & 7) {
    case 1:
      return "m";
    case 2:
      return "mm";
    case 3:
      return "um";
    default:
      return "";
  }
}

// Where the data begins: behind the header and four bytes that say whether there are extensions, at least.
Result<std::uint64_t> data_offset(const Fields& fields, const Version& version, bool is_attached, const std::string& name) {
  const double offset = fields.vox_offset();
  if (!(offset >= 0 && offset <= 0x1p53)) return fail(name + ": the NIfTI header puts the samples at no place in the file");
  const auto bytes = std::uint64_t(offset);
  return is_attached ? std::max<std::uint64_t>(bytes, version.size + 4) : bytes;
}

}  // namespace

bool is_nifti(std::string_view start) { return find_version(start).has_value(); }

Result<VolumeHeader> read_nifti_header(const InputFile& file) {
  const std::string name = in_quotes(file.path());
  auto start = read_start(file, kNifti2Size);
  if (!start) return tl::unexpected<Error>(start.error());
  VolumeHeader header;
  if (is_gzip(*start)) {
    header.encoding = Encoding::deflate;
    start->assign(kNifti2Size, '\0');
    const auto got = decode({file}, 0, std::as_writable_bytes(std::span(*start)));
    if (!got) return tl::unexpected<Error>(got.error());
    start->resize(*got);
  }
  const auto found = find_version(*start);
  if (!found) return fail(name + " is not a NIfTI file: it has no NIfTI-1 or NIfTI-2 header, or that is cut short");
  const Version& version = *found->version;
  const Fields fields(*start, *found);
  header.format = version.name;
  if (fields.has_qform() || fields.has_sform()) header.labels.space = "RAS";
  header.big_endian = found->big_endian;

  const std::int64_t axes = fields.dim(0);
  if (axes < 1 || axes > 7) return fail(name + ": the NIfTI header has " + std::to_string(axes) + " axes; 1 to 7 are possible");
  if (axes < 3) return fail(name + " has " + std::to_string(axes) + (axes == 1 ? " axis" : " axes") + "; a volume has 3");
  for (std::int64_t k = 5; k <= axes; ++k) {
    if (fields.dim(std::size_t(k)) > 1)
      return fail(name + " has " + std::to_string(fields.dim(std::size_t(k))) + " numbers on axis " + std::to_string(k) +
                  "; one number a sample is read, at one or several time points");
  }
  if (axes >= 4) header.time_points = std::uint64_t(std::max<std::int64_t>(1, fields.dim(4)));
  const auto type = nifti_type(fields.datatype());
  if (!type)
    return fail(name + ": NIfTI samples of type " + std::to_string(fields.datatype()) +
                " are not read; convert them to integers of 8 to 32 bits, float32 or float64");
  header.type = *type;
  const auto grid = make_grid({fields.dim(1), fields.dim(2), fields.dim(3)}, affine_of(fields), name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  if (auto size = check_size(header, name); !size) return tl::unexpected<Error>(size.error());
  if (const double slope = fields.slope(); slope != 0 && std::isfinite(slope)) {  // others mean that there is none
    if (!std::isfinite(fields.intercept())) return fail(name + ": the NIfTI header has a slope, and an intercept that is no number");
    header.slope = slope;
    header.intercept = fields.intercept();
  }
  header.labels.unit = unit_of(fields.units());
  if (const std::string_view field = trimmed(fields.intent_name()); is_label(field)) header.labels.field = field;

  const bool is_attached = (*start)[version.magic + 1] == '+';
  const auto offset = data_offset(fields, version, is_attached, name);
  if (!offset) return tl::unexpected<Error>(offset.error());
  if (!is_attached) header.data_file = file.path().stem().string() + ".img";
  // In a compressed file the samples follow the header in the decoded bytes.
  header.byte_skip = std::int64_t(*offset);
  return header;
}

}  // namespace intervale
