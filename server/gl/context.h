// A headless GL 4.5 core context on EGL. Displays are tried in order: every EGL device (EGL_EXT_platform_device), then
// Mesa's surfaceless platform, so that a GPU is found where there is one and llvmpipe elsewhere.
#pragma once

#include <memory>
#include <string>

namespace gonio::gl {

struct ContextOptions {
    int device = -1;     // index of the EGL device to use; -1: first that works
    bool debug = false;  // KHR_debug messages of high and medium severity are counted
};

class Context {
public:
    // Makes the context current on the calling thread. Throws std::runtime_error with one sentence if there is none.
    static std::unique_ptr<Context> create(const ContextOptions& options);
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    const std::string& description() const { return description_; }  // one line: display, vendor, renderer, version
    const std::string& renderer() const { return renderer_; }
    bool software() const;                                  // llvmpipe, softpipe, swrast
    int debug_messages() const { return debug_messages_; }  // since the start; 0 in a correct program
    const std::string& last_debug_message() const { return last_message_; }
    // Result: whether the GPU lost the context (GL_ARB_robustness); everything must be rebuilt then.
    bool lost() const;

private:
    Context(void* display, void* context, const std::string& display_name, bool debug);

    void *display_, *context_;  // EGL's
    std::string description_, renderer_, last_message_;
    int debug_messages_ = 0;
};

}  // namespace gonio::gl
