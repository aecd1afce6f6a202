// Preloaded under AddressSanitizer: libraries stay loaded to the end, so that what Mesa's driver never frees is told with
// the driver's name and not as that of an unknown module.
int dlclose(void* library) {
    (void)library;
    return 0;
}
