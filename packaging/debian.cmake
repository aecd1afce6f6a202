# ./dev package: what the Debian package holds beside `cmake --install`, and CPack's part of it (preset package).
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(debian ${CMAKE_CURRENT_SOURCE_DIR}/debian)

# Man pages and completions, of what the built programs say of themselves.
set(option_texts ${CMAKE_CURRENT_BINARY_DIR}/option_texts)
install(CODE "
    foreach(program goniod gonio gonio-bench)
        execute_process(COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/option_texts.py
            ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/\${program} ${option_texts} \$ENV{SOURCE_DATE_EPOCH} COMMAND_ERROR_IS_FATAL ANY)
    endforeach()
    execute_process(COMMAND ${Python3_EXECUTABLE} ${debian}/changelog.py ${PROJECT_VERSION} ${option_texts} \$ENV{SOURCE_DATE_EPOCH}
        COMMAND_ERROR_IS_FATAL ANY)
")
install(DIRECTORY ${option_texts}/share/ DESTINATION share)
install(FILES ${debian}/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES ${debian}/goniod.toml DESTINATION /etc/goniod)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "renders rooms lit by measured luminaires, live and in lux")
set(CPACK_PACKAGE_DESCRIPTION "goniod is a headless lighting-previsualisation server. It renders a
glTF scene lit by luminaires of IES and EULUMDAT photometry, with direct
light and every bounce, and streams the picture to browsers. It takes
changes from them, from sACN, Art-Net, OSC and fader boxes. gonio drives it
from the command line; gonio-bench measures it.")
set(CPACK_PACKAGE_CONTACT "The Gonio authors <gonio@gonio.invalid>")
set(CPACK_DEBIAN_PACKAGE_NAME gonio)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# What postinst calls, and what no linker sees: the EGL and the GL that libepoxy opens, and Mesa's drivers behind them.
set(CPACK_DEBIAN_PACKAGE_DEPENDS "systemd | systemd-standalone-sysusers | systemd-sysusers, init-system-helpers (>= 1.54), libegl1, libopengl0 | libgl1, libegl-mesa0, libgl1-mesa-dri")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA "${debian}/postinst;${debian}/prerm;${debian}/postrm;${debian}/conffiles")
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
include(CPack)
