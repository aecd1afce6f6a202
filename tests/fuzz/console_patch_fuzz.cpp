// Any text into the reader of patch files: rows that pass the check and come back from writing, or an error with its
// place.
#include "tests/fuzz/console_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::fuzz::check_patch_file({reinterpret_cast<const char*>(data), size});
    return 0;
}
