#include "server/gl/context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <stdexcept>
#include <utility>
#include <vector>

#include "server/gl/vendor_files.h"

namespace gonio::gl {

Context::Context(void* display, void* context, const std::string& display_name, bool debug)
    : display_(display), context_(context) {
    const auto text = [](GLenum name) { return std::string(reinterpret_cast<const char*>(glGetString(name))); };
    renderer_ = text(GL_RENDERER);
    description_ = display_name + "; " + text(GL_VENDOR) + "; " + renderer_ + "; " + text(GL_VERSION);
    if (!debug) return;
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    const GLDEBUGPROC on_message = [](GLenum, GLenum type, GLuint, GLenum severity, GLsizei, const GLchar* message,
                                      const void* self) {
        if (severity != GL_DEBUG_SEVERITY_HIGH && severity != GL_DEBUG_SEVERITY_MEDIUM) return;
        if (type == GL_DEBUG_TYPE_PERFORMANCE || type == GL_DEBUG_TYPE_PUSH_GROUP || type == GL_DEBUG_TYPE_POP_GROUP)
            return;
        auto* own = static_cast<Context*>(const_cast<void*>(self));
        ++own->debug_messages_;
        own->last_message_ = message;
    };
    glDebugMessageCallback(on_message, this);
}

Context::~Context() {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
    eglTerminate(display_);
}

bool Context::software() const {
    return renderer_.find("llvmpipe") != std::string::npos || renderer_.find("softpipe") != std::string::npos;
}

bool Context::lost() const {
    // Only the three legal values count as a loss; some drivers return others.
    const GLenum status = glGetGraphicsResetStatus();
    return status == GL_GUILTY_CONTEXT_RESET || status == GL_INNOCENT_CONTEXT_RESET ||
           status == GL_UNKNOWN_CONTEXT_RESET;
}

// EGL's displays and what they are called, in the order that they are tried in.
static std::vector<std::pair<EGLDisplay, std::string>> candidates(int device) {
    std::vector<std::pair<EGLDisplay, std::string>> result;
    const auto has = [](const char* extension) { return epoxy_has_egl_extension(EGL_NO_DISPLAY, extension); };
    EGLDeviceEXT devices[32];
    EGLint count = 0;
    if ((has("EGL_EXT_device_enumeration") || has("EGL_EXT_device_base")) && has("EGL_EXT_platform_device") &&
        eglQueryDevicesEXT(32, devices, &count)) {
        for (EGLint i = 0; i < count; ++i) {
            if (device >= 0 && device != i) continue;
            result.emplace_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr),
                                "EGL device " + std::to_string(i));
        }
    }
    if (device < 0 && has("EGL_MESA_platform_surfaceless")) {
        result.emplace_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr),
                            "EGL surfaceless");
    }
    return result;
}

std::unique_ptr<Context> Context::create(const ContextOptions& options) {
    std::string tried;
    for (const auto& [display, name] : candidates(options.device)) {
        tried += (tried.empty() ? "" : ", ") + name;
        EGLint major = 0, minor = 0;
        if (display == EGL_NO_DISPLAY || !eglInitialize(display, &major, &minor)) continue;
        std::vector<EGLint> attributes = {EGL_CONTEXT_MAJOR_VERSION,       4,
                                          EGL_CONTEXT_MINOR_VERSION,       5,
                                          EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                          EGL_CONTEXT_OPENGL_DEBUG,        options.debug ? EGL_TRUE : EGL_FALSE};
        if (minor >= 5 || major > 1) {
            attributes.insert(attributes.end(),
                              {EGL_CONTEXT_OPENGL_ROBUST_ACCESS, EGL_TRUE,
                               EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY, EGL_LOSE_CONTEXT_ON_RESET});
        }
        attributes.push_back(EGL_NONE);
        EGLContext context = EGL_NO_CONTEXT;
        if (epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context") &&
            epoxy_has_egl_extension(display, "EGL_KHR_no_config_context") && eglBindAPI(EGL_OPENGL_API))
            context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
        if (context == EGL_NO_CONTEXT || !eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
            eglTerminate(display);
            continue;
        }
        if (!epoxy_has_gl_extension("GL_ARB_shader_viewport_layer_array")) {
            throw std::runtime_error(
                "the GL driver lacks GL_ARB_shader_viewport_layer_array, which cube maps are rendered with");
        }
        return std::unique_ptr<Context>(new Context(display, context, name, options.debug));
    }
    const std::string dead = dead_vendor_files();
    throw std::runtime_error("no EGL display offers a headless OpenGL 4.5 core context (tried: " +
                             (tried.empty() ? std::string("none") : tried) + ")" + (dead.empty() ? "" : "; " + dead));
}

}  // namespace gonio::gl
