// What read-hdf5 asks of the objects in a file.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace intervale {

// A handle of the library.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Handle& operator=(Handle&&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  [[nodiscard]] hid_t get() const { return id_; }
  [[nodiscard]] bool is_open() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

// The lengths of a dataset's axes; none if it has none.
[[nodiscard]] std::vector<hsize_t> dims_of(hid_t dataset);

// Whether the file itself has the numbers: an array may also be said to lie in any other file.
[[nodiscard]] bool is_in_file(hid_t dataset);

// The numbers of an attribute that are finite, if it has no more than `most`.
[[nodiscard]] std::vector<double> numbers_of_attribute(hid_t object, const char* name, std::size_t most);

// Up to 1000 bytes; nothing if there is no such text.
[[nodiscard]] std::string text_of_attribute(hid_t object, const char* name);

}  // namespace intervale
