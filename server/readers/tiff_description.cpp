#include "server/readers/tiff_description.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <pugixml.hpp>
#include <string_view>
#include <utility>

#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

// The metres in a unit of length; 0: not known.
double metres_in(std::string_view unit) {
  constexpr std::array<std::pair<std::string_view, double>, 7> kUnits{
      {{"\u00b5m", 1e-6}, {"nm", 1e-9}, {"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}, {"\u00c5", 1e-10}, {"pm", 1e-12}}};
  const auto* const found = std::find_if(kUnits.begin(), kUnits.end(), [unit](const auto& known) { return known.first == unit; });
  return found == kUnits.end() ? 0 : found->second;
}

// Whatever its namespace is called.
bool has_name(const pugi::xml_node& node, std::string_view name) {
  const std::string_view whole = node.name();
  return whole.substr(whole.find(':') + 1) == name;
}

// The first child of that name.
pugi::xml_node child_of(const pugi::xml_node& node, std::string_view name) {
  return node.find_child([name](const pugi::xml_node& child) { return has_name(child, name); });
}

// The file that an element says its planes are in, unless it is this one: by its name, or by its UUID if it was renamed.
std::optional<std::string> other_file_of(const pugi::xml_node& data, std::string_view own_uuid, std::string_view own_name) {
  const pugi::xml_node uuid = child_of(data, "UUID");
  const std::string_view text = trimmed(uuid.text().as_string()), file = uuid.attribute("FileName").as_string();
  if (text.empty() && file.empty()) return {};
  if ((!text.empty() && text == own_uuid) || (!file.empty() && file == own_name)) return {};
  return std::string(file);
}

std::vector<TiffData> tiff_data_of(const pugi::xml_node& pixels, std::string_view own_uuid, std::string_view own_name) {
  std::vector<TiffData> all;
  for (const pugi::xml_node& element : pixels.children()) {
    if (!has_name(element, "TiffData")) continue;
    const auto number = [&element](const char* name) { return number_of<std::uint64_t>(element.attribute(name).as_string()); };
    all.push_back({number("FirstZ").value_or(0), number("FirstC").value_or(0), number("FirstT").value_or(0), number("IFD"), number("PlaneCount"),
                   other_file_of(element, own_uuid, own_name)});
  }
  return all;
}

Described described_by_ome(const pugi::xml_node& pixels) {
  Described d;
  const std::array<const char*, 3> keys{"PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"};
  for (std::size_t k = 0; k < 3; ++k) {
    const double size = pixels.attribute(keys[k]).as_double(1);
    if (!std::isfinite(size) || !(size > 0) || !pixels.attribute(keys[k])) continue;
    const std::string unit = pixels.attribute((std::string(keys[k]) + "Unit").c_str()).as_string("\u00b5m");
    if (d.unit.empty()) d.unit = unit;
    d.has_known_units = d.has_known_units && (unit == d.unit || (metres_in(unit) > 0 && metres_in(d.unit) > 0));
    d.spacing[k] = unit == d.unit ? size : size * metres_in(unit) / metres_in(d.unit);
  }
  d.slices = pixels.attribute("SizeZ").as_ullong(0);
  d.channels = pixels.attribute("SizeC").as_ullong(1);
  d.time_points = pixels.attribute("SizeT").as_ullong(1);
  const std::string order = pixels.attribute("DimensionOrder").as_string();
  for (const char* known : {"ZCT", "ZTC", "CZT", "CTZ", "TZC", "TCZ"}) {
    if (order == std::string("XY") + known) d.order = known;
  }
  return d;
}

Described described_by_imagej(std::string_view text, TIFF* tiff) {
  Described d;
  const auto value = [text](const std::string& key) {
    const auto at = text.find("\n" + key + "=");
    return at == text.npos ? std::string_view() : text.substr(at + key.size() + 2, text.find('\n', at + 1) - at - key.size() - 2);
  };
  d.channels = number_of<std::uint64_t>(value("channels")).value_or(1);
  d.time_points = number_of<std::uint64_t>(value("frames")).value_or(1);
  d.slices = number_of<std::uint64_t>(value("slices")).value_or(0);
  d.images = number_of<std::uint64_t>(value("images")).value_or(1);
  d.order = "CZT";
  d.unit = value("unit") == "micron" || value("unit") == "\\u00B5m" ? "\u00b5m" : std::string(value("unit"));
  float x = 0, y = 0;
  if (!d.unit.empty() && TIFFGetField(tiff, TIFFTAG_XRESOLUTION, &x) == 1 && TIFFGetField(tiff, TIFFTAG_YRESOLUTION, &y) == 1 && x > 0 && y > 0) {
    d.spacing[0] = 1 / double(x);
    d.spacing[1] = 1 / double(y);
  }
  const double z = number_of<double>(value("spacing")).value_or(d.unit.empty() ? 1 : d.spacing[0]);
  if (std::isfinite(z) && z != 0) d.spacing[2] = std::abs(z);
  return d;
}

}  // namespace

Described description_of(TIFF* tiff) {
  const char* text = nullptr;
  if (TIFFGetField(tiff, TIFFTAG_IMAGEDESCRIPTION, &text) != 1 || text == nullptr) return {};
  if (std::string_view(text).starts_with("ImageJ=")) return described_by_imagej(text, tiff);
  pugi::xml_document document;
  if (!document.load_string(text)) return {};
  const pugi::xml_node ome = child_of(document, "OME"), pixels = child_of(child_of(ome, "Image"), "Pixels");
  if (!pixels) return {};
  Described described = described_by_ome(pixels);
  const std::string name = std::filesystem::path(TIFFFileName(tiff)).filename().string();
  described.data = tiff_data_of(pixels, ome.attribute("UUID").as_string(), name);
  return described;
}

}  // namespace intervale
