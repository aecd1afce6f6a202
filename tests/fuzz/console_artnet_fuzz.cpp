// Any bytes into the decoder and what follows it: a value that keeps its promises, or an error with a code and a place.
#include "tests/fuzz/console_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::fuzz::check_artnet({data, size});
    return 0;
}
