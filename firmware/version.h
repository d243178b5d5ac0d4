/* What the version line says at boot. The date is that of the release, not of the build: the same sources make the
 * same image. */
#ifndef VERSION_H
#define VERSION_H

#define VERSION_NUMBER "0.1"
#define VERSION_DATE "2026-11-22"

#endif
