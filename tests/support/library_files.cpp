#include "tests/support/library_files.h"

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace intervale::testing {
namespace {

template <class T>
std::string little(T value) {
  std::string bytes;
  for (std::size_t k = 0; k < sizeof(T); ++k) bytes += char(std::uint64_t(value) >> (8 * k) & 255);
  return bytes;
}

template <class T>
std::string samples(const std::vector<T>& numbers) {
  std::string bytes;
  for (const T number : numbers) bytes += little(number);
  return bytes;
}

// An entry of a TIFF directory. type: 2 text, 3 u16, 4 u32.
std::string entry(std::uint16_t tag, std::uint16_t type, std::uint32_t count, std::uint32_t value) {
  return little(tag) + little(type) + little(count) + little(value);
}

// Writes a DICOM element; vr: what its value is.
using WriteElement = std::string (*)(std::uint16_t group, std::uint16_t number, std::string_view vr, std::string value);

std::string element(std::uint16_t group, std::uint16_t number, std::string_view vr, std::string value) {
  if (value.size() % 2 != 0) value += vr == "UI" ? '\0' : ' ';
  const bool is_long = vr == "OB" || vr == "OW";
  const std::string length = is_long ? little(std::uint16_t(0)) + little(std::uint32_t(value.size())) : little(std::uint16_t(value.size()));
  return little(group) + little(number) + std::string(vr) + length + value;
}

std::string implicit_element(std::uint16_t group, std::uint16_t number, std::string_view vr, std::string value) {
  if (value.size() % 2 != 0) value += vr == "UI" ? '\0' : ' ';
  return little(group) + little(number) + little(std::uint32_t(value.size())) + value;
}

constexpr const char* kCtImages = "1.2.840.10008.5.1.4.1.1.2";
std::string name_of(const DicomImage& image) { return "1.2.3.4." + std::to_string(image.instance); }

std::string elements_of(const DicomImage& image, WriteElement write) {
  std::string file =
      write(8, 0x16, "UI", kCtImages) + write(8, 0x18, "UI", name_of(image)) + write(8, 0x60, "CS", "CT") + write(0x18, 0x50, "DS", "2");
  file += write(0x20, 0xe, "UI", image.series) + write(0x20, 0x11, "IS", "1") + write(0x20, 0x13, "IS", std::to_string(image.instance));
  file += write(0x20, 0x32, "DS", image.position) + write(0x20, 0x37, "DS", image.orientation);
  const auto number = [write](std::uint16_t at, std::uint16_t value) { return write(0x28, at, "US", little(value)); };
  file += number(2, 1) + write(0x28, 4, "CS", "MONOCHROME2") + number(0x10, image.rows) + number(0x11, image.columns);
  file += write(0x28, 0x30, "DS", "0.5\\0.25") + number(0x100, 16) + number(0x101, image.bits) + number(0x102, std::uint16_t(image.bits - 1)) +
          number(0x103, 1);
  file += write(0x28, 0x1052, "DS", image.intercept) + write(0x28, 0x1053, "DS", image.slope);
  return file + write(0x7fe0, 0x10, "OW", samples(image.pixels));
}

}  // namespace

std::string tiff_file(std::uint32_t width, std::uint32_t height, const std::vector<std::vector<std::uint16_t>>& pages, const std::string& description,
                      std::uint16_t samples_a_pixel) {
  std::string file = std::string("II*\0", 4) + little(std::uint32_t(0));
  std::size_t link = 4;  // where the place of the next directory is written
  for (std::size_t k = 0; k < pages.size(); ++k) {
    const auto data = std::uint32_t(file.size());
    const std::string bytes = samples(pages[k]);
    file += bytes;
    const auto text = std::uint32_t(file.size());
    const bool has_text = k == 0 && !description.empty();
    if (has_text) file += description + '\0';
    if (file.size() % 2 != 0) file += '\0';
    file.replace(link, 4, little(std::uint32_t(file.size())));
    std::string directory = entry(256, 4, 1, width) + entry(257, 4, 1, height) + entry(258, 3, 1, 16) + entry(259, 3, 1, 1);
    directory += entry(262, 3, 1, samples_a_pixel == 1 ? 1 : 2);
    if (has_text) directory += entry(270, 2, std::uint32_t(description.size() + 1), text);
    directory +=
        entry(273, 4, 1, data) + entry(277, 3, 1, samples_a_pixel) + entry(278, 4, 1, height) + entry(279, 4, 1, std::uint32_t(bytes.size()));
    file += little(std::uint16_t(directory.size() / 12)) + directory;
    link = file.size();
    file += little(std::uint32_t(0));
  }
  return file;
}

std::string imagej_file(std::uint32_t width, std::uint32_t height, const std::vector<std::uint16_t>& numbers, const std::string& description) {
  const auto big = [](auto value) {
    std::string bytes = little(value);
    std::reverse(bytes.begin(), bytes.end());
    return bytes;
  };
  const auto field = [&big](std::uint16_t tag, std::uint32_t value, bool is_short = false) {
    const std::string number = is_short ? big(std::uint16_t(value)) + std::string(2, '\0') : big(value);
    return big(tag) + big(std::uint16_t(is_short ? 3 : 4)) + big(std::uint32_t(1)) + number;
  };
  constexpr std::uint32_t kText = 8 + 2 + 9 * 12 + 4;  // where the description begins
  const auto length = std::uint32_t(description.size() + 1), data = kText + length;
  std::string file = std::string("MM\0*", 4) + big(std::uint32_t(8)) + big(std::uint16_t(9));
  file += field(256, width) + field(257, height) + field(258, 16, true) + field(262, 1, true);
  file += big(std::uint16_t(270)) + big(std::uint16_t(2)) + big(length) + big(kText);
  file += field(273, data) + field(277, 1, true) + field(278, height) + field(279, 2 * width * height) + big(std::uint32_t(0));
  file += description + '\0';
  for (const std::uint16_t number : numbers) file += big(number);
  return file;
}

std::string dicom_file(const DicomImage& image) {
  const std::string meta = element(2, 1, "OB", std::string("\0\1", 2)) + element(2, 2, "UI", kCtImages) + element(2, 3, "UI", name_of(image)) +
                           element(2, 0x10, "UI", "1.2.840.10008.1.2.1");
  return std::string(128, '\0') + "DICM" + element(2, 0, "UL", little(std::uint32_t(meta.size()))) + meta + elements_of(image, element);
}

std::string implicit_dicom_file(const DicomImage& image) { return elements_of(image, implicit_element); }

}  // namespace intervale::testing
