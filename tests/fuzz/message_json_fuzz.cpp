// A client's message in any bytes, and the scene after it.
#include "tests/fuzz/message_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::fuzz::check_client_message(gonio::Encoding::json, {reinterpret_cast<const char*>(data), size});
    return 0;
}
