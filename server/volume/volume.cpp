#include "server/volume/volume.h"

namespace intervale {

std::size_t size_of(SampleType type) {
  switch (type) {
    case SampleType::u8:
    case SampleType::i8:
      return 1;
    case SampleType::u16:
    case SampleType::i16:
      return 2;
    case SampleType::u32:
    case SampleType::i32:
    case SampleType::f32:
      return 4;
    case SampleType::f64:
      break;
  }
  return 8;
}

const char* name_of(SampleType type) {
  switch (type) {
    case SampleType::u8:
      return "u8";
    case SampleType::i8:
      return "i8";
    case SampleType::u16:
      return "u16";
    case SampleType::i16:
      return "i16";
    case SampleType::u32:
      return "u32";
    case SampleType::i32:
      return "i32";
    case SampleType::f32:
      return "f32";
    case SampleType::f64:
      break;
  }
  return "f64";
}

}  // namespace intervale
