#ifndef coronaryImageColours_h
#define coronaryImageColours_h

/**
 * From now on images in HU (the array HU of the readers and the phantom) are shown in grey, with a window for the heart
 * with contrast medium, and keep it from phase to phase. What a user saves as default for that array goes before it.
 * The window stays when the image is first shown, because that is a CoronaryImageRepresentation (coronaryImages.xml).
 */
void coronaryShowImagesInGrey();

#endif
