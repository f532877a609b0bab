#ifndef coronaryImageColours_h
#define coronaryImageColours_h

/**
 * From now on images in HU (the array HU of the readers and the phantom) are shown in grey, with a window for the heart
 * with contrast medium, and keep it from phase to phase. What a user saves as default for that array goes before it.
 * ParaView 5.11 widens the window to the values of the image when it makes a slice of an outline.
 */
void coronaryShowImagesInGrey();

#endif
