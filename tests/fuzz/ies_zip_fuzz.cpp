// Any bytes as a zip archive: entries within the limits, or errors with a code and a place.
#include "tests/fuzz/ies_container_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::ies::fuzz::check_zip({reinterpret_cast<const char*>(data), size});
    return 0;
}
